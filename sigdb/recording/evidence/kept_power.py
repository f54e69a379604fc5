"""Power of an average over the revolutions, by lines between samples. Importing this module imports numba."""

import numpy as np

from sigdb.core import FloatArray, kernel


@kernel
def kept_power(
    x: FloatArray, mean: float, pulses: FloatArray, each: int, revolutions: int, n: int
) -> tuple[float, float]:
    """Return the power of the average of a record less its mean, and that of its revolutions, in n steps of angle.

    A revolution has so many of the pulses, whose places are counted in samples.
    """
    sums, power = np.zeros(n), 0.0
    last = len(x) - 1
    for r in range(revolutions):
        for j in range(n):
            p = (r + j / n) * each
            i = min(int(p), len(pulses) - 2)
            place = min(max(pulses[i] + (p - i) * (pulses[i + 1] - pulses[i]), 0.0), float(last))
            k = min(int(place), last - 1)
            y = x[k] + (place - k) * (x[k + 1] - x[k]) - mean
            sums[j] += y
            power += y * y
    return float(np.mean((sums / revolutions) ** 2)), power / (revolutions * n)
