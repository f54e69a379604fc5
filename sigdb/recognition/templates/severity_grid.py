"""Grids of templates over stiffness loss and phase shift, and the error of what lies between them."""

from collections.abc import Sequence
from dataclasses import dataclass
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
        average; the sum of those along both axes.
    stiffness_loss, phase_shift_deg
        Least and greatest severity; equal where there is one.
    """

    teeth: int
    error: float
    stiffness_loss: Range
    phase_shift_deg: Range

    @property
    def holds(self) -> bool:
        """Whether the error is small enough for answers between the severities."""
        return self.error <= _MOST


@dataclass(frozen=True, kw_only=True, eq=False)
class SeverityGrid:
    """Templates at all crossings of some stiffness losses and phase shifts, for one number of damaged teeth.

    Attributes
    ----------
    damaged_teeth
        Number of damaged teeth.
    levels
        Stiffness losses, and phase shifts (deg), each rising.
    places
        (losses, shifts) places of the templates; that without loss and shift is the healthy one.
    """

    damaged_teeth: float
    levels: tuple[FloatArray, FloatArray]
    places: IntArray

    def error(self, signals: FloatArray) -> float:
        """Return the estimated greatest error, in norm, of signals (templates, n) between those of the grid."""
        placed = signals[self.places]
        lines = placed, placed.swapaxes(0, 1)
        return sum(_line_error(levels, line) for levels, line in zip(self.levels, lines, strict=True))


def severity_grids(severity: FloatArray, healthy: BoolArray) -> list[SeverityGrid]:
    """Return the grids that templates form, one for each number of damaged teeth.

    There are none where a crossing is missing or there are two templates at one, as for severities drawn at random.

    Parameters
    ----------
    severity
        (templates, 3) stiffness loss, phase shift (deg) and number of damaged teeth; nan for a pattern.
    healthy
        (templates,) whether a template is of a healthy gear.
    """
    none = np.flatnonzero(healthy)
    plain = np.flatnonzero(~healthy & np.isfinite(severity).all(axis=1))
    grids = []
    for count in np.unique(severity[plain, 2]):
        at = plain[severity[plain, 2] == count]
        sizes = severity[at, :2]
        through_none = len(none) == 1 and bool((sizes == 0).any(axis=0).all() or (sizes == 0).all(axis=0).any())
        if through_none:
            at, sizes = np.append(at, none), np.vstack([sizes, [0.0, 0.0]])
        losses, loss = np.unique(sizes[:, 0], return_inverse=True)
        shifts, shift = np.unique(sizes[:, 1], return_inverse=True)
        places = np.full((len(losses), len(shifts)), -1)
        places[loss, shift] = at
        if places.min() < 0 or places.size != len(at):
            return []
        grids.append(SeverityGrid(damaged_teeth=float(count), levels=(losses, shifts), places=places))
    return grids


def severity_weights(levels: Sequence[FloatArray], losses: FloatArray, shifts: FloatArray) -> FloatArray:
    """Return the weights (losses shifts, losses and shifts of levels) of a grid's templates in interpolated signals.

    Parameters
    ----------
    levels
        Those of a :class:`SeverityGrid`.
    losses, shifts
        Stiffness losses and phase shifts (deg) between them.
    """
    along = [spline_weights(level, at) for level, at in zip(levels, (losses, shifts), strict=True)]
    return np.kron(*along)


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
    losses, shifts = zip(*(grid.levels for of_point in grids for grid in of_point), strict=True)
    return SeverityInterpolation(
        teeth=teeth,
        error=max(errors) / noise,
        stiffness_loss=_ends(losses),
        phase_shift_deg=_ends(shifts),
    )


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
