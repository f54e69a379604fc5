"""Splits of rows into folds."""
