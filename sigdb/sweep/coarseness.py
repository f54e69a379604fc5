"""Where between its cases a database is too coarse."""

from collections.abc import Container, Mapping

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray

COLUMNS = ("axis", "from", "to", "cases", "least_match", "median_match", "greatest_separation")
_INTERVALS = 10
"""Of an axis with more intervals than these, so many equal ones are told of."""


def coarseness(cases: pd.DataFrame, values: Mapping[str, FloatArray], whole: Container[str]) -> pd.DataFrame:
    """Cases off the grid by the interval between neighbouring values of an axis that they lie in.

    Parameters
    ----------
    cases
        As :attr:`Coverage.cases`.
    values
        The grid's values of each axis to look at, ascending. An axis that has more than ten intervals, as a sampled one
        has, is divided into ten equal ones.
    whole
        Axes of whole numbers: they are told by value.

    Returns
    -------
    pandas.DataFrame
        The columns :data:`COLUMNS`. An interval without cases is left out.
    """
    rows = []
    for axis, grid in values.items():
        for low, high in zip(grid, grid, strict=True) if axis in whole else _intervals(grid):
            inside = cases[cases[axis].between(low, high)]
            if len(inside):
                match, separation = inside["match"], inside["separation"].max()
                rows.append((axis, low, high, len(inside), match.min(), match.median(), separation))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _intervals(grid: FloatArray) -> list[tuple[float, float]]:
    edges = grid if len(grid) <= _INTERVALS + 1 else np.linspace(grid[0], grid[-1], _INTERVALS + 1)
    return list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
