"""Weights of a windowed sinc, tabulated over the fraction of a sample."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

HALF_WIDTH = 16
"""Zero crossings of the sinc on either side. The gain is within 3e-6 of 1 up to 0.38 of the sampling rate."""

_BETA = 12.0
_CELLS = 512
_DEGREE = 2
"""Parabolas on 512 cells of a sample follow the weights to 3e-10; a wider kernel is as much smoother."""


def reach(stretch: float) -> int:
    """Return the samples on either side that a kernel takes."""
    return int(np.ceil(HALF_WIDTH * stretch))


@lru_cache(maxsize=64)
def sinc_table(stretch: float) -> NDArray[np.float64]:
    """Return the coefficients ``(cells, 3, 2 reach)`` of the weights as parabolas of the place within a cell.

    Between samples k and k + 1, at the fraction f, cell ``q = floor(cells f)`` has the weight of sample
    ``k - reach + 1 + i`` as ``sum_d table[q, d, i] (cells f - q)^d``. A stretch s widens the kernel s times, which cuts
    off at 1/(2 s) of the sampling rate.
    """
    cells = int(np.ceil(_CELLS / stretch))
    # At Chebyshev's nodes interpolation leaves the least error.
    nodes = (1 - np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))) / 2
    fraction = (np.arange(cells)[:, None] + nodes) / cells
    taps = np.arange(2 * reach(stretch)) - reach(stretch) + 1
    u = (taps - fraction[..., None]) / stretch
    inside = 1 - np.square(u / HALF_WIDTH)
    h = np.where(inside > 0, np.sinc(u) * np.i0(_BETA * np.sqrt(np.maximum(inside, 0))), 0.0)
    # A constant stays what it is.
    h /= h.sum(axis=-1, keepdims=True)
    table = np.linalg.solve(np.vander(nodes, increasing=True), h).astype(np.float64, copy=False)
    table.flags.writeable = False
    return table
