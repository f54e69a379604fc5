"""Conformal quantiles: thresholds that a new row passes with a stated probability, whatever the law of the scores."""

import math

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import IntArray

COVERAGE = 0.9
"""Nominal coverage of sets and intervals."""

BY_CELL, OVER_ALL = "cell", "all"
"""Whether coverage holds in each cell of severity, noise and operating point, or on average over all rows."""

COVERED = 0.99
"""Share of the training rows, about, that are within the threshold of *outside the database*."""


def row_quantile(scores: ArrayLike, level: float) -> float:
    """Return the value that a further exchangeable score does not exceed, with a probability of at least level.

    It is the k-th smallest of m scores, ``k = ceil(level (m + 1))`` [1]_.

    Parameters
    ----------
    scores
        (m,) scores of rows that were not used to make the scorer.
    level
        Between 0 and 1.

    Returns
    -------
    float
        Infinite where k > m: so few scores support no such level.

    References
    ----------
    .. [1] V. Vovk, A. Gammerman, G. Shafer, "Algorithmic Learning in a Random World", Springer 2005,
           doi:10.1007/b106715.

    Examples
    --------
    >>> row_quantile([3.0, 1.0, 2.0], 0.75), row_quantile([3.0, 1.0, 2.0], 0.76)
    (3.0, inf)
    """
    ordered = np.sort(np.asarray(scores, float))
    k = math.ceil(level * (len(ordered) + 1) - _ROUNDING)
    return float(ordered[max(k, 1) - 1]) if k <= len(ordered) else math.inf


def specimen_quantile(scores: ArrayLike, specimens: ArrayLike, level: float) -> float:
    """Return :func:`row_quantile` for a row of a further specimen, where rows of a specimen resemble each other.

    It is the quantile of ``sum_k 1 / (K + 1) (mean over the rows of specimen k of delta_score) + 1 / (K + 1)
    delta_infinity`` over K specimens (hierarchical conformal prediction [1]_).

    Parameters
    ----------
    scores
        (rows,) scores.
    specimens
        (rows,) specimen of each.
    level
        Between 0 and 1.

    Returns
    -------
    float
        Infinite where ``level > K / (K + 1)``: 0.9 needs nine specimens.

    References
    ----------
    .. [1] Y. Lee, R. F. Barber, R. Willett, "Distribution-free inference with hierarchical data", arXiv:2306.06342,
           2023.

    Examples
    --------
    >>> specimen_quantile([1.0, 2.0, 3.0], [7, 7, 8], 1 / 3), specimen_quantile([1.0, 2.0, 3.0], [7, 7, 8], 0.7)
    (2.0, inf)
    """
    values = np.asarray(scores, float)
    if not values.size:
        return math.inf
    _, index, counts = np.unique(np.asarray(specimens), return_inverse=True, return_counts=True)
    order = np.argsort(values)
    share = np.cumsum(1 / ((len(counts) + 1) * counts[index[order]]))
    reached = np.flatnonzero(share >= level - _ROUNDING)
    return float(values[order[reached[0]]]) if reached.size else math.inf


def least_specimens(level: float) -> int:
    """Return the least number of specimens that supports a level.

    Examples
    --------
    >>> least_specimens(0.9)
    9
    """
    return math.ceil(level / (1 - level) - _ROUNDING)


def greatest_quantile(scores: ArrayLike, cells: IntArray, specimens: ArrayLike, level: float) -> float:
    """Return the greatest :func:`specimen_quantile` of some cells of rows, which covers a further row of any of them.

    Cells of fewer specimens than the level needs are merged. If these have too few specimens together, they are merged
    with all rows.

    Parameters
    ----------
    scores
        (rows,) scores.
    cells
        (rows,) number of each row's cell.
    specimens
        (rows,) specimen of each.
    level
        Between 0 and 1.

    Returns
    -------
    float
        Infinite where all rows together are of too few specimens.

    Examples
    --------
    >>> greatest_quantile([1.0, 2.0, 5.0, 6.0], [0, 0, 1, 1], [7, 8, 7, 8], 1 / 3)
    5.0
    """
    values, specimens = np.asarray(scores, float), np.asarray(specimens)
    few: list[IntArray] = []
    quantiles: list[float] = []
    for at in rows_by_cell(np.asarray(cells)):
        quantile = specimen_quantile(values[at], specimens[at], level)
        if math.isfinite(quantile):
            quantiles.append(quantile)
        else:
            few.append(at)
    if few:
        rest = np.concatenate(few)
        quantile = specimen_quantile(values[rest], specimens[rest], level)
        quantiles.append(quantile if math.isfinite(quantile) else specimen_quantile(values, specimens, level))
    return max(quantiles, default=math.inf)


def rows_by_cell(cells: IntArray) -> list[IntArray]:
    """Return the indices of the rows of each cell, in the order of the cells' numbers."""
    order = np.argsort(cells, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(cells[order])) + 1) if len(order) else []


_ROUNDING = 1e-9
