"""Pages and figures of a recording."""
