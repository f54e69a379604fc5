"""Recordings of one machine, and one answer from several channels, operating points and recordings."""
