"""The work of a sweep: templates first, then rows, in parallel."""
