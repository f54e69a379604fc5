"""How signals change beyond the most severe templates."""

import numpy as np

from sigdb.core import BoolArray, FloatArray


def outward_changes(severity: FloatArray, healthy: BoolArray, signals: FloatArray) -> FloatArray:
    """Return the change of the signal beyond the greatest value of each size of damage.

    Templates that differ in one size only lie on a line; a healthy template is at 0 on lines through it. The
    change at the end of a line is the slope of the parabola through its last three templates, or of the straight line
    through two. A size such as a phase shift may have an end below 0 too.

    Parameters
    ----------
    severity
        (templates, quantities) sizes, and number of damaged teeth; nan where the damage does not have a size.
    healthy
        (templates,) whether a template is of a healthy gear.
    signals
        (templates, n) nominal averages.

    Returns
    -------
    (templates, sizes, n) float64
        0 for templates that are not at an end.
    """
    changes = np.zeros((len(severity), severity.shape[1] - 1, signals.shape[1]))
    none = np.flatnonzero(healthy)[:1]
    severity = np.where(np.isnan(severity[:, -1:]), np.nan, severity)
    for size in range(severity.shape[1] - 1):
        others = np.nan_to_num(np.delete(severity, size, axis=1))
        plain = np.flatnonzero(~healthy & np.isfinite(severity[:, size]))
        for line in np.unique(others[plain], axis=0):
            at = plain[(others[plain] == line).all(axis=1)]
            if (line[:-1] == 0).all() and 0.0 not in severity[at, size]:
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
