"""The march in time, with backlash."""
