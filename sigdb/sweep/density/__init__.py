"""How densely a grid covers its axes, and how to refine it."""
