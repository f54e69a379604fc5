"""Identification: the rigs that meet what is known of one, as an ensemble with intervals and predictions."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "Identification",
    "Minimum",
    "Targets",
    "identify",
    "load_targets",
    "minimise",
    "write_identification",
]
