"""Overview of a recording: what was read, and faults of its samples."""
