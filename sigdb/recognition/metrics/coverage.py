"""Coverage of intervals and sets where it matters: cell by cell, not only on average."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.significance import above_bound

ENOUGH = 2000
"""Rows of a cell below which its coverage is not given."""

LEAST_COVERAGE = 0.88
"""Coverage of 90 % sets and intervals below which a cell is at fault."""

SEVERITY = ("stiffness_loss", "damaged_teeth")
"""Columns that cells never mix, but for bands of those with many values; healthy rows have no damaged teeth."""

CELL = (*SEVERITY, "snr_db", "speed_rpm", "torque")
"""What a cell is made of: severity, noise, operating point."""


def value_bands(values: pd.Series, *, most: int = 6) -> pd.Series:
    """The values themselves where few are distinct, else the median of the values of each of so many quantile bands.

    Examples
    --------
    >>> import pandas as pd
    >>> value_bands(pd.Series([1.0, 2.0, 2.0])).tolist()
    [1.0, 2.0, 2.0]
    >>> value_bands(pd.Series([1.0, 2.0, 3.0, 4.0]), most=2).tolist()
    [1.5, 1.5, 3.5, 3.5]
    """
    if values.nunique() <= most:
        return values.astype(float)
    return values.groupby(pd.qcut(values, most, labels=False, duplicates="drop")).transform("median").astype(float)


def coverage_cells(
    inside: FloatArray, rows: pd.DataFrame, *, by: Sequence[str] = CELL, enough: int = ENOUGH, seed: int = 0
) -> pd.DataFrame:
    """Share of rows whose truth is inside, for each cell of at least so many rows.

    Rows of each severity are halved in turn at the medians of noise, speed and torque, as long as both halves have
    enough rows: cells are as fine as the rows allow, and all rows of a severity with enough of them are in one.

    Parameters
    ----------
    inside
        (rows,) 1 where the truth is in the interval or set, 0 where not, nan where the row does not count.
    rows
        ``specimen`` and the columns of ``by``, of which those that it lacks do not count.
    by
        Columns that make a cell.
    enough
        Least number of rows of a cell.
    seed
        Seed of the bootstrap over the specimens of a cell.

    Returns
    -------
    pandas.DataFrame
        The cell, by the medians of its columns, ``rows``, ``coverage`` and the ends of its interval, ``low`` and
        ``high``; ``below``: whether it is below :data:`LEAST_COVERAGE` at 99 % confidence, by the scatter between
        specimens.
    """
    known = rows[~np.isnan(inside)].assign(inside=inside[~np.isnan(inside)])
    columns = [name for name in by if name in rows]
    severity = [value_bands(known[name]).to_numpy() for name in columns if name in SEVERITY]
    halved = known[[name for name in columns if name not in SEVERITY]].to_numpy(float)
    table = [
        known.iloc[at][columns].median().to_dict() | {"rows": len(at)} | _share(known.iloc[at], seed)
        for own in known.groupby(severity or np.zeros(len(known)), dropna=False).indices.values()
        for at in _halves(halved, np.asarray(own), enough)
        if len(at) >= enough
    ]
    return pd.DataFrame(table, columns=[*columns, "rows", "coverage", "low", "high", "below"])


def _halves(values: FloatArray, at: IntArray, enough: int, axis: int = 0) -> list[IntArray]:
    """Rows ``at`` halved at the median of a column of values (all rows, columns), then their halves at the next one's.

    A column that cannot be halved so that both halves have enough rows is passed over.
    """
    count = values.shape[1]
    for k in (np.arange(count) + axis) % max(count, 1):
        column = values[at, k]
        middle = np.median(column)
        for above in (column > middle, column >= middle):
            if enough <= above.sum() <= len(at) - enough:
                return [cell for half in (~above, above) for cell in _halves(values, at[half], enough, k + 1)]
    return [at]


def _share(own: pd.DataFrame, seed: int) -> dict[str, float | bool]:
    inside = own["inside"].to_numpy()
    figure = Specimens(own["specimen"], seed=seed).mean(inside)
    below = above_bound(inside, np.full(len(inside), LEAST_COVERAGE), own["specimen"]).significant
    return {"coverage": figure.value, "low": figure.low, "high": figure.high, "below": below}


def set_values(sets: BoolArray, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Of each row, the size of its conformal set, and whether the truth is in it, of damaged and of healthy rows."""
    true = rows["tooth"].to_numpy(int)
    inside = sets[np.arange(len(true)), true].astype(float)
    return {
        "set_size": sets.sum(axis=1).astype(float),
        "set_coverage": inside,
        "set_coverage_damaged": np.where(true > 0, inside, np.nan),
        "set_coverage_healthy": np.where(true > 0, np.nan, inside),
    }


def set_figures(sets: BoolArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """Mean size and coverage of conformal sets, over all rows and by label.

    Parameters
    ----------
    sets
        (rows, 1 + teeth) whether 'none' and each tooth is in the set.
    rows
        ``tooth`` and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    specimens = Specimens(rows["specimen"], seed=seed)
    return {name: specimens.mean(value) for name, value in set_values(sets, rows).items()}
