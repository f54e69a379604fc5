"""Rigs from what is known of a machine: the rest follows from rules of machine design."""
