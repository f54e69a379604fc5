"""Evidence in a recording: whether the mesh stands out of the noise."""
