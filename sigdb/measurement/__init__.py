"""What a sensor, a specimen and an average add to a clean signal, as a stated random law."""

from sigdb.measurement.noise import noise_deviation, revolution_scatter
from sigdb.measurement.settings import Measurement
from sigdb.measurement.specimen import index_error_covariance, index_errors, tooth_cycle

__all__ = [
    "Measurement",
    "index_error_covariance",
    "index_errors",
    "noise_deviation",
    "revolution_scatter",
    "tooth_cycle",
]
