"""The random law of a measurement: index errors of specimens, noise, and scatter between revolutions."""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)

__all__ = [
    "MeasurementSettings",
    "NuisanceSettings",
    "PitchTolerances",
    "index_error_covariance",
    "index_errors",
    "noise_deviation",
    "pitch_errors",
    "pitch_tolerances",
    "revolution_scatter",
    "tooth_cycle",
]
