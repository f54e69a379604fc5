"""The periodic steady state: the healthy rig once, and damage as a small correction."""
