"""Noise by order: its shape, and how even residuals are once it is taken out."""
