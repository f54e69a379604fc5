"""What match compares: residual signals of averages of unit standard deviation."""

import numpy as np

from sigdb.core import FloatArray
from sigdb.signature import residual_signal

_NOTHING = 64 * float(np.finfo(np.float32).eps)
"""Root mean square of a residual that is rounding of the stored float32, in standard deviations."""


def unit_residuals(tsa: FloatArray, teeth: int) -> FloatArray:
    """Residuals of averages, each divided by its standard deviation over the revolution.

    Parameters
    ----------
    tsa
        (..., n) averages, in any unit.
    teeth
        Tooth count of the averaged gear.

    Returns
    -------
    (..., n) float64
        Mean, mesh harmonics and shaft orders 1 and 2 removed; exactly 0 where no more than float32's rounding is left
        (of a clean healthy average), or the average does not vary.
    """
    x = np.asarray(tsa, dtype=float)
    scale = np.abs(x).max(axis=-1, keepdims=True, initial=0)
    deviation = x.std(axis=-1, keepdims=True)
    varies = deviation > _NOTHING * scale
    z = residual_signal(x / np.where(varies, deviation, 1), teeth=teeth)
    return np.where(varies & (root_mean_square(z)[..., None] > _NOTHING), z, 0.0)


def root_mean_square(z: FloatArray) -> FloatArray:
    """Root mean square over the revolution."""
    rms: FloatArray = np.sqrt(np.mean(np.square(z), axis=-1))
    return rms
