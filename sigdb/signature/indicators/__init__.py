"""Condition indicators of averages."""
