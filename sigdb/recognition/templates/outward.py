"""How signals change beyond the most severe templates, and whether an average asks for more of that change."""

import numpy as np

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.templates.turned_laws import TurnedLaws

_SIZES = 2
"""The first severities, stiffness loss and phase shift, are sizes; the third is the number of damaged teeth."""


def outward_changes(severity: FloatArray, healthy: BoolArray, signals: FloatArray) -> FloatArray:
    """Return the change of the signal beyond the greatest stiffness loss and phase shift.

    Templates that differ in one of the two only lie on a line; a healthy template is at 0 on lines through it. The
    change at the end of a line is the slope of the parabola through its last three templates, or of the straight line
    through two. A phase shift may have an end below 0 too.

    Parameters
    ----------
    severity
        (templates, 3) stiffness loss, phase shift (deg) and number of damaged teeth.
    healthy
        (templates,) whether a template is of a healthy gear.
    signals
        (templates, n) nominal averages.

    Returns
    -------
    (templates, 2, n) float64
        0 for templates that are not at an end.
    """
    changes = np.zeros((len(severity), _SIZES, signals.shape[1]))
    none = np.flatnonzero(healthy)[:1]
    for size in range(_SIZES):
        others = np.delete(severity, size, axis=1)
        plain = np.flatnonzero(~healthy & np.isfinite(severity).all(axis=1))
        for line in np.unique(others[plain], axis=0):
            at = plain[(others[plain] == line).all(axis=1)]
            if line[0] == 0 and 0.0 not in severity[at, size]:
                at = np.concatenate([at, none])
            levels, first = np.unique(severity[at, size], return_index=True)
            at = at[first]
            if len(levels) < 2:
                continue
            for sign, end in ((1, slice(-3, None)), (-1, slice(2, None, -1))):
                last = at[end][-1]
                if sign * severity[last, size] > 0:
                    changes[last, size] = sign * _end_slope(levels[end], signals[at[end]])
    return changes


def _end_slope(levels: FloatArray, signals: FloatArray) -> FloatArray:
    """Return the derivative at the last of two or three levels, of the polynomial through them."""
    away = levels[-1] - levels[:-1]
    slopes = (signals[-1] - signals[:-1]) / away[:, None]
    if len(levels) == 2:
        return np.asarray(slopes[0])
    far, near = away
    return np.asarray((slopes[1] * far - slopes[0] * near) / (far - near))


def beyond(
    laws: TurnedLaws,
    outward: FloatArray,
    x: FloatArray,
    best: IntArray,
    *,
    noise: FloatArray,
    index_error: float,
    coefficients: FloatArray | None,
) -> FloatArray:
    """Return by how many standard deviations averages ask for more damage than the most severe template has.

    It is the score test of the most likely template: with its law N(s, S) and the change d of the signal beyond it,
    ``d' S^-1 (x - s) / sqrt(d' S^-1 d)``. Under that law it is a standard normal number.

    Parameters
    ----------
    laws
        Laws of the templates.
    outward
        (templates, 2, n) of :func:`outward_changes`.
    x
        (rows, n) averages.
    best
        (rows, 2) the most likely template of each, and its turn in teeth.
    noise, index_error, coefficients
        As for :meth:`TurnedLaws.log_likelihood`; noise (rows,).

    Returns
    -------
    (rows,) float64
        The greater one of the two sizes; 0 where the most likely template is not at an end.
    """
    score = np.zeros(len(x))
    at_end = np.asarray(outward.any(axis=2))
    for template in np.unique(best[:, 0]):
        changes = outward[template, at_end[template]]
        if not len(changes):
            continue
        rows = np.flatnonzero(best[:, 0] == template)
        residual = residual_of(
            laws, int(template), best[rows, 1], x[rows], None if coefficients is None else coefficients[rows]
        )
        modes, d = laws.modes[template], (laws.gains[template] * laws.size(index_error) / noise[rows, None]) ** 2
        shrunk = d / (1 + d)
        along = changes @ modes
        product = residual @ changes.T - (residual @ modes * shrunk) @ along.T
        square = (changes**2).sum(axis=1) - shrunk @ (along**2).T
        score[rows] = (product / noise[rows, None] / np.sqrt(square)).max(axis=1)
    return score


def residual_of(
    laws: TurnedLaws, template: int, turn: IntArray, x: FloatArray, coefficients: FloatArray | None = None
) -> FloatArray:
    """Return averages (rows, n), turned back by the turn of each, without the mean of a template."""
    places = (np.arange(laws.samples) + turn[:, None] * (laws.samples // laws.teeth)) % laws.samples
    return np.take_along_axis(x, places, axis=1) - laws.mean(template, turn, coefficients)


def whitened_residual(
    laws: TurnedLaws, template: int, residual: FloatArray, *, noise: FloatArray, index_error: float
) -> tuple[FloatArray, FloatArray]:
    """Return ``S^(-1/2) r`` and ``S^-1 r`` of residuals under the law N(s, S) of a template, (rows, n) each.

    With the modes U and d as in :meth:`TurnedLaws.log_likelihood`, ``S^(-1/2) r = (r - U (1 - 1 / sqrt(1 + rho d)) U'
    r) / noise``: white noise of variance 1 where r follows the law.
    """
    modes = laws.modes[template]
    d = (laws.gains[template] * (laws.size(index_error) / noise)[:, None]) ** 2
    amplitude = residual @ modes
    white = (residual - (amplitude * (1 - 1 / np.sqrt(1 + d))) @ modes.T) / noise[:, None]
    weighted = (residual - (amplitude * (d / (1 + d))) @ modes.T) / noise[:, None] ** 2
    return white, weighted
