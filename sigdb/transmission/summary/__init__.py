"""A rig in numbers and words, and a rig file to begin with."""
