"""Readers of recordings, one file a format: each gives the columns that a file holds, and knows nothing of channels."""
