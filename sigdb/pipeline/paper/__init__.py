"""The paper's claims, P1 to P10, as numbers on simulated signals."""
