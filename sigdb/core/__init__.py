"""Fields with unit, bounds and help declared once; errors; random streams; array types; compiled kernels."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Note",
    "Progress",
]
