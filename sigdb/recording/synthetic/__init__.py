"""Synthetic raw recordings of a rig."""
