"""Names of splits, and of the columns that they and targets are made of."""

QUANTITIES = ("stiffness_loss", "phase_shift_deg", "damaged_teeth")
"""Columns of a severity: relative loss of stiffness, phase shift in degrees, number of damaged teeth."""

MEMBER = "rig_member"
"""Column with the member of an ensemble that a row's rig is, where there is one."""

POINT = ("speed_rpm", "torque")
"""Columns of an operating point: speed in rpm, torque in N m."""

KIND = "kind"
"""Column with the kind of damage of a row."""

NO_DAMAGE, PATTERN = "none", "pattern"
"""Kind of healthy gears, and of damaged teeth that differ."""

MEASURED_SPLITS = ("recording", "machine", "load", "set", "random")
"""Names of the splits of measured rows."""

SPLIT_NAMES = ("S0", "S1", "S2", "S3", "S4", "S6", "S7", *MEASURED_SPLITS)
"""Names of the splits of one database."""
