"""The kernels that sample revolutions, and add them to an average. Importing this module imports numba."""

import numpy as np
from numpy.typing import NDArray

from sigdb.core import kernel
from sigdb.signature.averaging.sinc_kernel import HALF_WIDTH

_TAPS = 2 * HALF_WIDTH
"""Taps of a kernel that is not stretched."""


@kernel
def add_revolutions(
    x: NDArray[np.float64],
    start: float,
    fs: float,
    spline: NDArray[np.float64],
    first_pulse: float,
    pulses: float,
    table: NDArray[np.float64],
    count: int,
    revolutions: int,
    mean: NDArray[np.float64],
    squares: NDArray[np.float64],
) -> None:
    """Add revolutions count, count + 1, ... to the running mean and sum of squared deviations, ``(channels, n)``.

    Sample i of x, ``(channels, samples)``, is at the time (start + i) / fs. The time at the place p of the pulses'
    count is ``spline``, ``(4, intervals)``, cubics of p - first_pulse; a revolution has ``pulses`` of them.
    """
    n = mean.shape[1]
    cells, _, taps = table.shape
    before = taps // 2 - 1
    last = spline.shape[1] - 1
    for r in range(count, count + revolutions):
        weight = 1.0 / (r + 1)
        for j in range(n):
            p = (r + j / n) * pulses - first_pulse
            i = min(int(p), last)
            w = p - i
            place = (((spline[0, i] * w + spline[1, i]) * w + spline[2, i]) * w + spline[3, i]) * fs - start
            k = int(place)
            f = (place - k) * cells
            q = int(f)
            f -= q
            h0, h1, h2 = table[q, 0], table[q, 1], table[q, 2]
            for c in range(x.shape[0]):
                # A slice, so that the loop is vectorised.
                v = x[c, k - before : k - before + taps]
                y = 0.0
                for t in range(taps):
                    y += v[t] * (h0[t] + f * (h1[t] + f * h2[t]))
                d = y - mean[c, j]
                mean[c, j] += weight * d
                squares[c, j] += d * (y - mean[c, j])


@kernel
def sample_revolution(
    x: NDArray[np.float64],
    start: float,
    fs: float,
    spline: NDArray[np.float64],
    first_pulse: float,
    pulses: float,
    table: NDArray[np.float64],
    sampled: NDArray[np.float64],
) -> None:
    """Write the first revolution in equal steps of angle, ``(channels, n)``; arguments as of ``add_revolutions``."""
    n = sampled.shape[1]
    cells, _, taps = table.shape
    before = taps // 2 - 1
    last = spline.shape[1] - 1
    for j in range(n):
        p = j / n * pulses - first_pulse
        i = min(int(p), last)
        w = p - i
        place = (((spline[0, i] * w + spline[1, i]) * w + spline[2, i]) * w + spline[3, i]) * fs - start
        k = int(place)
        f = (place - k) * cells
        q = int(f)
        f -= q
        h0, h1, h2 = table[q, 0], table[q, 1], table[q, 2]
        for c in range(x.shape[0]):
            v = x[c, k - before : k - before + taps]
            y = 0.0
            if taps == _TAPS:
                # With a constant count the loop is unrolled.
                for t in range(_TAPS):
                    y += v[t] * (h0[t] + f * (h1[t] + f * h2[t]))
            else:
                for t in range(taps):
                    y += v[t] * (h0[t] + f * (h1[t] + f * h2[t]))
            sampled[c, j] = y
