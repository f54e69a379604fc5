"""Rows of a database for training loops: datasets of NumPy arrays, which loaders of torch take as they are."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "BatchDataset",
    "RowDataset",
]
