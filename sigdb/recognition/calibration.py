"""Scores of teeth to probabilities: a slope of the scores, and a level of 'none'."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import log_softmax
from sklearn.model_selection import GroupKFold

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray, IntArray

_FOLDS = 5


def with_none(scores: FloatArray, slope: float, none: ArrayLike) -> FloatArray:
    """(rows, 1 + teeth) scores of 'none' and of each tooth, whose softmax is the probability."""
    return np.column_stack([np.broadcast_to(none, len(scores)), slope * scores])


def calibrated(scores: FloatArray, y: IntArray, offset: ArrayLike = 0.0) -> tuple[float, float]:
    """Slope of the scores and level of 'none' that make the labels most likely.

    Parameters
    ----------
    scores
        (rows, teeth) of rows that the scorer has not seen; -inf where a gear has no such tooth.
    y
        (rows,) first damaged tooth, 0 for none.
    offset
        What is known of the level of 'none', one or (rows,); the level is added to it.
    """

    def loss(parameters: FloatArray) -> float:
        log_slope, none = parameters
        stacked = with_none(scores, np.exp(log_slope), none + np.asarray(offset))
        return -float(log_softmax(stacked, axis=1)[np.arange(len(y)), y].mean())

    found = minimize(loss, np.zeros(2), method="Nelder-Mead").x
    return float(np.exp(found[0])), float(found[1])


def specimen_folds_of(groups: IntArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Rows to calibrate on and rows of other specimens to judge, so that each row is judged once.

    With one specimen its own rows have to do.
    """
    count = len(np.unique(groups))
    if count < 2:
        yield np.arange(len(groups)), np.arange(len(groups))
        return
    yield from GroupKFold(min(_FOLDS, count)).split(groups, groups=groups)


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
