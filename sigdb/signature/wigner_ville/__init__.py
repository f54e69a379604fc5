"""The Wigner-Ville distribution and its pooled features."""
