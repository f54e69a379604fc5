"""The plan of a sweep: cases, templates and rows, as a pure function of the recipe."""
