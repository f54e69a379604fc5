"""Rows of a database as estimators read them."""
