"""The design of a sweep: grids and their axes, as a recipe declares them."""
