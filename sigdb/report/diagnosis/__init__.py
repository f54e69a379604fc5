"""Page and text of a diagnosis."""
