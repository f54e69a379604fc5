"""Scores of teeth to probabilities: a slope of the scores, and a level of 'none'."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import log_softmax
from sklearn.model_selection import GroupKFold

from sigdb.core import FloatArray, InputError, IntArray, blocks
from sigdb.recognition.rows.batch import ROWS_AT_ONCE

_FOLDS = 5

_LEAST_SLOPE = 1e-3
"""Slope of uninformative scores; above zero, so that they keep their order."""


def with_none(scores: FloatArray, slope: ArrayLike, none: ArrayLike) -> FloatArray:
    """(rows, 1 + teeth) scores of 'none' and of each tooth, whose softmax is the probability.

    The slope and the level of 'none' are numbers, or (rows,).
    """
    return np.column_stack([np.broadcast_to(none, len(scores)), np.reshape(slope, (-1, 1)) * scores])


def calibrate(scores: FloatArray, y: IntArray, offset: ArrayLike = 0.0) -> tuple[float, float]:
    """Slope of the scores and level of 'none' that make the labels most likely.

    Parameters
    ----------
    scores
        (rows, teeth) of rows that the scorer has not seen; -inf where a gear has no such tooth.
    y
        (rows,) first damaged tooth, 0 for none.
    offset
        Known part of the level of 'none', a number or (rows,). The fitted level is added to it.
    """
    offset, damaged = np.broadcast_to(np.asarray(offset, float), len(y)), y > 0
    parts = list(blocks(len(y), ROWS_AT_ONCE))
    unit = np.sqrt(sum(float((_finite(scores[some]) ** 2).sum()) for some in parts) / max(scores.size, 1))
    unit = max(unit, np.finfo(float).tiny)  # both parameters count alike

    def part(some: slice, slope: float, none: float) -> FloatArray:
        """Return the sums over some rows of the loss and of its derivatives."""
        finite, true, rows = _finite(scores[some]), y[some], np.arange(len(y[some]))
        log_p = log_softmax(with_none(scores[some], slope, none + offset[some]), axis=1)
        p, of_truth = np.exp(log_p), np.where(true > 0, finite[rows, true - 1], 0.0)
        by_slope = (p[:, 1:] * finite).sum(axis=1) - of_truth
        return np.array([-log_p[rows, true].sum(), by_slope.sum(), (p[:, 0] - ~damaged[some]).sum()])

    def loss(parameters: FloatArray) -> tuple[float, FloatArray]:
        sums = np.sum([part(some, parameters[0] / unit, parameters[1]) for some in parts], axis=0)
        value, by_slope, by_none = sums / len(y)
        return float(value), np.array([by_slope / unit, by_none])

    # Convex, so that any descent finds the least one.
    bounds = [(_LEAST_SLOPE * unit, None), (None, None)]
    optimum = minimize(loss, [unit, 0.0], jac=True, bounds=bounds, method="L-BFGS-B", options={"ftol": 1e-12}).x
    return float(optimum[0] / unit), float(optimum[1])


def _finite(scores: FloatArray) -> FloatArray:
    """Return scores with 0 for teeth that a gear does not have."""
    return np.where(np.isfinite(scores), scores, 0.0)


def specimen_folds_of(groups: IntArray, folds: int = _FOLDS) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield rows to calibrate on and rows of other specimens to apply it to, so that each row is used once.

    With one specimen, its own rows serve for both.
    """
    count = len(np.unique(groups))
    if count < 2:
        yield np.arange(len(groups)), np.arange(len(groups))
        return
    yield from GroupKFold(min(folds, count)).split(groups, groups=groups)


def check_labels(teeth: IntArray, y: IntArray) -> None:
    """Refuse labels of teeth that a gear does not have, and labels of one kind only.

    Raises
    ------
    InputError
        Names the tooth, or says what is missing.
    """
    wrong = y[(y < 0) | (y > teeth)]
    if wrong.size:
        raise InputError(
            f"y holds tooth {wrong[0]}, which its gear does not have; give 0 for none, or 1 up to the tooth count"
        )
    if not (y > 0).any() or not (y == 0).any():
        raise InputError("y must hold both healthy rows (0) and damaged ones; add the missing kind")
