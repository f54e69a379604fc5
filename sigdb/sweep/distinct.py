"""Distinct rows of columns, numbered in the order in which they appear."""

from typing import Any

import numpy as np
import pandas as pd

from sigdb.core.typing import IntArray


def distinct(*columns: Any) -> tuple[IntArray, IntArray]:
    """Number of each row's combination of values, and the row in which each combination appears first.

    Parameters
    ----------
    columns
        (n,) each, numbers without nan.

    Returns
    -------
    codes : ndarray of int, (n,)
        From 0, in order of first appearance.
    first : ndarray of int, (combinations,)

    Examples
    --------
    >>> codes, first = distinct([5, 2, 5, 5], [1.0, 0.0, 1.0, 0.0])
    >>> codes.tolist(), first.tolist()
    ([0, 1, 0, 2], [0, 1, 3])
    """
    codes = np.zeros(len(columns[0]), np.int64)
    for column in columns:
        own, values = pd.factorize(np.asarray(column))
        if len(values) > 1:
            codes = pd.factorize(codes * len(values) + own)[0]
    before = np.maximum.accumulate(np.concatenate([[-1], codes]))[:-1]
    return codes, np.flatnonzero(codes > before)


def consecutive(start: Any, count: Any) -> IntArray:
    """Ranges ``start ... start + count - 1``, one after another.

    Examples
    --------
    >>> consecutive([5, 0], [2, 3]).tolist()
    [5, 6, 0, 1, 2]
    """
    start, count = np.asarray(start, np.int64), np.asarray(count, np.int64)
    before = np.cumsum(count) - count
    return np.repeat(start - before, count) + np.arange(int(count.sum()))
