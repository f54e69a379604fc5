"""The quantities that describe the severity of damage."""

QUANTITIES = ("stiffness_loss", "phase_shift_deg", "damaged_teeth")
"""Columns of a severity: relative loss of stiffness, phase shift in degrees, number of damaged teeth."""
