"""Search for the least value of a function that need not be smooth, by CMA-ES."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sigdb.core import FloatArray, InputError

_WORST = 1e12
"""Value of a point at which a function has none."""


@dataclass(frozen=True, kw_only=True)
class Minimum:
    """The end of a search.

    Attributes
    ----------
    point
        (dimensions,) the best point of the unit cube.
    value
        Value there.
    evaluations
        Number of values that the search took.
    """

    point: FloatArray
    value: float
    evaluations: int


def minimise(
    misfit: Callable[[FloatArray], float],
    dimensions: int,
    rng: np.random.Generator,
    *,
    start: FloatArray | None = None,
    spread: float = 0.25,
    evaluations: int = 1000,
    enough: float = -np.inf,
    tolerance: float = 1e-3,
    recorded: tuple[float, ...] = (),
    on_value: Callable[[float], object] | None = None,
) -> Minimum:
    """Search the unit cube for the least value of a function, by CMA-ES [1]_.

    Parameters
    ----------
    misfit : callable
        Function of a point (dimensions,) of the unit cube. A value that is not finite counts as the worst.
    dimensions : int
        Number of coordinates.
    rng : Generator
        Source of all randomness: with the same state the same points are tried.
    start : array, (dimensions,), optional
        Point to begin from; the middle of the cube if left out.
    spread : float
        Standard deviation of the first points.
    evaluations : int
        Greatest number of values, up to the rest of a generation.
    enough : float
        Value at or below which the search ends.
    tolerance : float
        Differences of values below which the search ends.
    recorded : tuple of float
        Values of an earlier search that was stopped: they stand for its first evaluations, so that it goes on.
    on_value : callable, optional
        Called with each new value, in order.

    Returns
    -------
    Minimum

    Raises
    ------
    InputError
        If the package ``cma`` is not installed.

    References
    ----------
    .. [1] N. Hansen, "The CMA evolution strategy: a tutorial", 2016, arXiv:1604.00772.

    Examples
    --------
    >>> import numpy as np
    >>> end = minimise(lambda u: float(((u - 0.3) ** 2).sum()), 2, np.random.default_rng(1), tolerance=1e-12)
    >>> end.point.round(3).tolist()
    [0.3, 0.3]
    """
    strategy = _strategy(dimensions, rng, np.full(dimensions, 0.5) if start is None else start, spread, tolerance)
    best, lowest, count = np.full(dimensions, 0.5), np.inf, 0
    while count < evaluations and not strategy.stop():
        points = [np.clip(point, 0.0, 1.0) for point in strategy.ask()]
        values = []
        for point in points:
            if count < len(recorded):
                value = recorded[count]
            else:
                value = float(np.nan_to_num(misfit(point), nan=_WORST, posinf=_WORST))
                if on_value is not None:
                    on_value(value)
            count += 1
            values.append(value)
            if value < lowest:
                best, lowest = point, value
            if lowest <= enough:
                return Minimum(point=best, value=lowest, evaluations=count)
        strategy.tell(points, values)
    return Minimum(point=best, value=lowest, evaluations=count)


def _strategy(dimensions: int, rng: np.random.Generator, start: FloatArray, spread: float, tolerance: float) -> Any:
    """Return the strategy of the package, whose random numbers all come from a generator."""
    try:
        import cma
    except ImportError:
        raise InputError("this search needs the package cma, which is not installed: pip install cma") from None
    if dimensions < 2:
        raise InputError("CMA-ES needs two coordinates or more; give another number a range")
    options = {
        "bounds": [0.0, 1.0],
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,
        "tolfun": tolerance,
        "tolfunhist": tolerance,
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }
    return cma.CMAEvolutionStrategy(np.clip(start, 0.0, 1.0), spread, options)
