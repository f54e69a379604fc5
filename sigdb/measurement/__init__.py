"""The random law of a measurement: index errors of specimens, noise, and scatter between revolutions."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "MeasurementSettings",
    "index_error_covariance",
    "index_errors",
    "noise_deviation",
    "revolution_scatter",
    "tooth_cycle",
]
