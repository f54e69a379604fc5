"""Recordings that are read in blocks, since they are larger than memory."""
