"""Samples of the unit cube, and their values in ranges."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from sigdb.core import FloatArray, sample_stream

Method = Literal["random", "latin-hypercube", "sobol"]


def unit_sample(method: Method, points: int, axes: int, rng: np.random.Generator) -> FloatArray:
    """Return points of the unit cube, each coordinate from 0 up to but not 1.

    Parameters
    ----------
    method
        ``random``: independent and uniform. ``latin-hypercube``: on each axis one point in each of ``points`` equal
        intervals [1]_. ``sobol``: the first points of a scrambled Sobol sequence [2]_, balanced where ``points`` is a
        power of two.
    points, axes
        Number of points and of axes.
    rng
        Generator of the points.

    Returns
    -------
    ndarray, (points, axes)

    References
    ----------
    .. [1] M. D. McKay, R. J. Beckman, W. J. Conover, "A comparison of three methods for selecting values of input
           variables in the analysis of output from a computer code", Technometrics 21 (1979) 239-245,
           doi:10.1080/00401706.1979.10489755.
    .. [2] A. B. Owen, "Scrambling Sobol' and Niederreiter-Xing points", Journal of Complexity 14 (1998) 466-489,
           doi:10.1006/jcom.1998.0487.

    Examples
    --------
    >>> import numpy as np
    >>> u = unit_sample("latin-hypercube", 4, 2, np.random.default_rng(0))
    >>> sorted((4 * u[:, 0]).astype(int).tolist())
    [0, 1, 2, 3]
    """
    return _METHODS[method](points, axes, rng)


def _random(points: int, axes: int, rng: np.random.Generator) -> FloatArray:
    return rng.random((points, axes))


def _latin_hypercube(points: int, axes: int, rng: np.random.Generator) -> FloatArray:
    from scipy.stats import qmc  # slow to load, and workers do not sample

    return np.asarray(qmc.LatinHypercube(axes, rng=rng).random(points))


def _sobol(points: int, axes: int, rng: np.random.Generator) -> FloatArray:
    from scipy.stats import qmc  # slow to load, and workers do not sample

    power = (points - 1).bit_length()
    return np.asarray(qmc.Sobol(axes, rng=rng).random_base2(power)[:points])


_METHODS: dict[str, Callable[[int, int, np.random.Generator], FloatArray]] = {
    "random": _random,
    "latin-hypercube": _latin_hypercube,
    "sobol": _sobol,
}


def grid_sample(method: Method, points: int, axes: tuple[str, ...], *, seed: int, grid: int) -> dict[str, FloatArray]:
    """Return the coordinates of a grid's sample by axis; the order of the axes does not matter."""
    names = sorted(axes)
    sample = unit_sample(method, points, len(names), sample_stream(seed, grid))
    return dict(zip(names, sample.T, strict=True))


def scale_to_range(u: FloatArray, low: float, high: float) -> FloatArray:
    """Return numbers from low to high at unit coordinates."""
    return low + u * (high - low)


def scale_to_whole(u: FloatArray, low: FloatArray | float, high: FloatArray | float) -> FloatArray:
    """Return whole numbers from low to high at unit coordinates: both ends included, all equally likely."""
    return np.minimum(low + np.floor(u * (np.asarray(high) - low + 1)), high)
