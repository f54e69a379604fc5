"""Where between its cases a database is too coarse."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray

COLUMNS = ("axis", "from", "to", "cases", "least_match", "median_match", "greatest_separation")


def coarseness(cases: pd.DataFrame, templates: pd.DataFrame, axes: Sequence[str]) -> pd.DataFrame:
    """Cases off the grid by the interval between neighbouring values of an axis that they lie in.

    Parameters
    ----------
    cases
        As :attr:`Coverage.cases`.
    templates
        Cases of the database's templates.
    axes
        Columns of both to look at. Those of whole numbers are told by value.

    Returns
    -------
    pandas.DataFrame
        The columns :data:`COLUMNS`. An axis of one value is left out, and an interval without cases.
    """
    rows = []
    for axis in axes:
        values = np.unique(templates[axis].dropna().to_numpy(float))
        if cases[axis].nunique() < 2 or len(values) < 2:
            continue
        for low, high in _intervals(values, whole=pd.api.types.is_integer_dtype(templates[axis])):
            inside = cases[cases[axis].between(low, high)]
            if len(inside):
                match, separation = inside["match"], inside["separation"].max()
                rows.append((axis, low, high, len(inside), match.min(), match.median(), separation))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _intervals(values: FloatArray, *, whole: bool) -> Iterator[tuple[float, float]]:
    return zip(values, values, strict=True) if whole else pairwise(values)
