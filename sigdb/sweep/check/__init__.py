"""Checks of a database against its plan."""
