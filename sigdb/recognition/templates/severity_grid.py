"""Grids of templates over the sizes of their damage, and the error of what lies between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TypeAlias

import numpy as np

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.templates.speed_curve import spline_weights

Range: TypeAlias = tuple[float, float]
"""Least and greatest value."""

_MOST = 1.0
"""Greatest error with which severities are continuous. An estimate from the quietest average is then off by no more
than its own standard deviation; the nearest template can be off by half a step."""

_LEAST_LEVELS = 3
"""Levels that show how good an interpolation is."""

_CUBIC = 4
"""Levels that a cubic takes."""

_ROUNDING = 1e-9
"""Divided differences, over the signals and the range to their power, that are of rounding."""

_LEFT_OUT = 4.0
"""Factor between the error at a level that is left out and that between all levels. Half the distance has a sixteenth
of the error of a cubic; but it is greater between the last two levels, which are not left out."""


@dataclass(frozen=True, kw_only=True)
class SeverityInterpolation:
    """The severities between which the templates of a tooth count are interpolated, and the error.

    Attributes
    ----------
    teeth
        Tooth count of the damaged gear.
    error
        Estimated greatest error of an interpolated signal, in norm, in standard deviations of the noise of the quietest
        average; the sum of those along all axes.
    sizes
        Least and greatest value of each size, in the order of the bank's quantities; empty in a model of an earlier
        version.
    """

    teeth: int
    error: float
    sizes: tuple[Range, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the error is small enough for answers between the severities."""
        return self.error <= _MOST


@dataclass(frozen=True, kw_only=True, eq=False)
class SeverityGrid:
    """Templates at all crossings of some values of each size, for one number of damaged teeth.

    Attributes
    ----------
    damaged_teeth
        Number of damaged teeth.
    levels
        Values of each size, rising.
    places
        (values of the first size, ...) places of the templates; that at 0 of each size is the healthy one.
    """

    damaged_teeth: float
    levels: tuple[FloatArray, ...]
    places: IntArray

    def error(self, signals: FloatArray) -> float:
        """Return the estimated greatest error, in norm, of signals (templates, n) between those of the grid."""
        placed = signals[self.places]
        errors = []
        for axis, levels in enumerate(self.levels):
            along = np.moveaxis(placed, axis, 0)
            errors.append(_line_error(levels, along.reshape(len(levels), -1, along.shape[-1])))
        return float(sum(errors))


def severity_grids(severity: FloatArray, healthy: BoolArray) -> list[SeverityGrid]:
    """Return the grids that templates form, one for each number of damaged teeth.

    There are none where a crossing is missing or there are two templates at one, as for severities drawn at random;
    nor where the damage is of several kinds, which have no size in common.

    Parameters
    ----------
    severity
        (templates, quantities) sizes, and number of damaged teeth; nan for a pattern.
    healthy
        (templates,) whether a template is of a healthy gear.
    """
    if (np.isfinite(severity[:, -1]) & ~np.isfinite(severity).all(axis=1)).any():
        return []
    none = np.flatnonzero(healthy)
    plain = np.flatnonzero(~healthy & np.isfinite(severity).all(axis=1))
    grids = []
    for count in np.unique(severity[plain, -1]):
        at = plain[severity[plain, -1] == count]
        sizes = severity[at, :-1]
        absent = (sizes == 0).all(axis=0)
        one_size = (~absent).sum() <= 1
        if len(none) == 1 and bool((sizes == 0).any(axis=0).all() or one_size):
            at, sizes = np.append(at, none), np.vstack([sizes, np.zeros(sizes.shape[1])])
        levels, place = zip(*(np.unique(column, return_inverse=True) for column in sizes.T), strict=True)
        places = np.full(tuple(map(len, levels)), -1)
        places[place] = at
        if places.min() < 0 or places.size != len(at):
            return []
        grids.append(SeverityGrid(damaged_teeth=float(count), levels=levels, places=places))
    return grids


def severity_weights(levels: Sequence[FloatArray], *sizes: FloatArray) -> FloatArray:
    """Return the weights (crossings of sizes, crossings of levels) of a grid's templates in interpolated signals.

    Parameters
    ----------
    levels
        Those of a :class:`SeverityGrid`.
    *sizes
        Values between them of each size, such as stiffness losses and phase shifts (deg).
    """
    return reduce(np.kron, (spline_weights(level, at) for level, at in zip(levels, sizes, strict=True)))


def severity_interpolation(
    teeth: int,
    severities: Sequence[FloatArray],
    healthy: Sequence[BoolArray],
    signals: Sequence[FloatArray],
    *,
    noise: float,
) -> SeverityInterpolation | None:
    """Return how far the templates of some operating points hold between their severities.

    Parameters
    ----------
    teeth
        Tooth count.
    severities, healthy, signals
        As of :func:`severity_grids`, and the nominal averages (templates, n), a list over operating points.
    noise
        Standard deviation of the noise of the quietest average, in the unit of the signals.

    Returns
    -------
    SeverityInterpolation or None
        None where the templates form no grid at some of the points.
    """
    grids = [severity_grids(*point) for point in zip(severities, healthy, strict=True)]
    if not all(grids):
        return None
    errors = [grid.error(at) for of_point, at in zip(grids, signals, strict=True) for grid in of_point]
    levels = zip(*(grid.levels for of_point in grids for grid in of_point), strict=True)
    return SeverityInterpolation(teeth=teeth, error=max(errors) / noise, sizes=tuple(map(_ends, levels)))


def _ends(levels: Sequence[FloatArray]) -> Range:
    every = np.concatenate(levels)
    return float(every.min()), float(every.max())


def _line_error(levels: FloatArray, signals: FloatArray) -> float:
    """Return the estimated greatest error of signals (levels, lines, n) between the levels.

    From five levels on it is that of leaving each out, over four. With three or four the polynomial
    goes through all, and the error is the next term of Newton's formula. Its divided difference is taken to exceed
    the last one as much as that exceeds the one before.
    """
    if len(levels) == 1:
        return 0.0
    if len(levels) < _LEAST_LEVELS:
        return float("inf")
    if len(levels) > _CUBIC:
        left_out = []
        for left in range(1, len(levels) - 1):
            kept = np.delete(np.arange(len(levels)), left)
            weights = spline_weights(levels[kept], levels[[left]])[0]
            left_out.append(_norm(np.tensordot(weights, signals[kept], axes=1) - signals[left]).max())
        return float(max(left_out)) / _LEFT_OUT
    before, last = _divided(levels[:-1], signals[:-1]), _divided(levels, signals)
    before = np.maximum(_norm(before), _norm(_divided(levels[1:], signals[1:])))
    at = np.linspace(levels[0], levels[-1], 201)
    product = np.abs(np.prod(at[:, None] - levels, axis=1)).max()
    rounding = _ROUNDING * _norm(signals).max() / (levels[-1] - levels[0]) ** (len(levels) - 1)
    next_one = np.where(_norm(last) > rounding, _norm(last) ** 2 / np.maximum(before, rounding), 0.0)
    return float(next_one.max() * product)


def _divided(levels: FloatArray, signals: FloatArray) -> FloatArray:
    """Return the divided difference of all levels, (lines, n)."""
    factors = [1 / np.prod(np.delete(level - levels, i)) for i, level in enumerate(levels)]
    return np.tensordot(np.array(factors), signals, axes=1)


def _norm(signals: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(signals, axis=-1))
