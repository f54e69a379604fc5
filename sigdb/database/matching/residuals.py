"""Residual signals of averages of unit standard deviation, which match compares."""

import numpy as np

from sigdb.core import FloatArray
from sigdb.signature import residual_signal

_NOTHING = 64 * float(np.finfo(np.float32).eps)
"""Root mean square of a residual that is rounding of the stored float32, in standard deviations."""


def unit_residuals(tsa: FloatArray, teeth: int) -> FloatArray:
    """Return residuals of averages, each average divided by its standard deviation over the revolution.

    Parameters
    ----------
    tsa
        (..., n) averages, in any unit.
    teeth
        Tooth count of the averaged gear.

    Returns
    -------
    (..., n) float64
        The averages without mean, mesh harmonics and shaft orders 1 and 2. They are exactly 0 where the rest is
        rounding of float32, as for a clean healthy average, or where the average does not vary.
    """
    x = np.asarray(tsa, dtype=float)
    scale = np.abs(x).max(axis=-1, keepdims=True, initial=0)
    deviation = x.std(axis=-1, keepdims=True)
    varies = deviation > _NOTHING * scale
    z = residual_signal(x / np.where(varies, deviation, 1), teeth=teeth)
    return np.where(varies & (root_mean_square(z)[..., None] > _NOTHING), z, 0.0)


def root_mean_square(z: FloatArray) -> FloatArray:
    """Return the root mean square over the revolution, (...) of (..., n)."""
    rms: FloatArray = np.sqrt(np.mean(np.square(z), axis=-1))
    return rms
