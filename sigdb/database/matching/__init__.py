"""Signatures compared with templates: distances, nearest neighbours, and what lies outside."""
