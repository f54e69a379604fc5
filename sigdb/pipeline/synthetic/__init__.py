"""Raw recordings made by the march in time, and what disturbs them: each ingredient a small function on arrays."""
