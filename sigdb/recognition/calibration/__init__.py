"""Calibrated probabilities, conformal sets and intervals, alarm thresholds."""
