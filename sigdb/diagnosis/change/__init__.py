"""The change of an average since healthy recordings: its statistics, their limits, and their power."""
