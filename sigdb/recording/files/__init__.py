"""Recordings read from files."""
