"""The folder of a model: its files, limits, seal and card."""
