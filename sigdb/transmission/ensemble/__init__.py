"""Ranges, choices and ties of a rig's assumed numbers, and draws from them."""
