"""Coverage of intervals and sets where it matters: cell by cell, not only on average."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.metrics.metric import Metric
from sigdb.recognition.metrics.significance import above_bound

ENOUGH = 2000
"""Fewest rows of a cell."""

LEAST_COVERAGE = 0.88
"""Least coverage of 90 % sets and intervals in a cell that counts as covered."""

SEVERITY = ("stiffness_loss", "damaged_teeth")
"""Columns whose values a cell never mixes, but for bands of many values; healthy rows have no damaged teeth."""

CELL = (*SEVERITY, "snr_db", "speed_rpm", "torque")
"""Columns of a cell: severity, noise and operating point."""


def value_bands(values: pd.Series, *, most: int = 6) -> pd.Series:
    """Return the values where few are distinct, else the median of the quantile band that holds each of them.

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
    """Return the share of rows whose truth is inside, for each cell with enough rows.

    Rows of each severity are halved in turn at the medians of noise, speed and torque, as long as both halves have
    enough rows. So cells are as fine as the rows allow, and every row of a severity with enough rows is in a cell.

    Parameters
    ----------
    inside
        (rows,) 1 where the truth is in the interval or set, 0 where it is not, NaN where the row does not count.
    rows
        ``specimen`` and the columns of ``by``; columns that it lacks do not count.
    by
        Columns that make a cell.
    enough
        Least number of rows of a cell.
    seed
        Seed of the bootstrap over the specimens of a cell.

    Returns
    -------
    pandas.DataFrame
        Medians of the cell's columns, ``rows``, ``coverage`` with the ends of its interval ``low`` and ``high``, and
        ``below``: whether the coverage is below :data:`LEAST_COVERAGE` at 99 % confidence, by the scatter between
        specimens.
    """
    counted = rows[~np.isnan(inside)].assign(inside=inside[~np.isnan(inside)])
    columns = [name for name in by if name in rows]
    severity = [value_bands(counted[name]).to_numpy() for name in columns if name in SHOWN_QUANTITIES]
    halved = counted[[name for name in columns if name not in SHOWN_QUANTITIES]].to_numpy(float)
    table = [
        counted.iloc[at][columns].median().to_dict() | {"rows": len(at)} | _share(counted.iloc[at], seed)
        for places in counted.groupby(severity or np.zeros(len(counted)), dropna=False).indices.values()
        for at in _halves(halved, np.asarray(places), enough)
        if len(at) >= enough
    ]
    return pd.DataFrame(table, columns=[*columns, "rows", "coverage", "low", "high", "below"])


def _halves(values: FloatArray, at: IntArray, enough: int, axis: int = 0) -> list[IntArray]:
    """Halve the rows ``at`` at the median of a column of values (all rows, columns), then the halves at the next one.

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


def _share(cell: pd.DataFrame, seed: int) -> dict[str, float | bool]:
    inside = cell["inside"].to_numpy()
    share = Specimens(cell["specimen"], seed=seed).mean(inside)
    below = above_bound(inside, np.full(len(inside), LEAST_COVERAGE), cell["specimen"]).significant
    return {"coverage": share.value, "low": share.low, "high": share.high, "below": below}


SET_METRICS = (
    Metric(name="set_size", title="classes in a 90 % set"),
    Metric(name="set_coverage", title="coverage of 90 % sets"),
    Metric(name="set_coverage_damaged", title="coverage of 90 % sets, damaged"),
    Metric(name="set_coverage_healthy", title="coverage of 90 % sets, healthy"),
)
"""Metrics of conformal sets."""


def set_values(sets: BoolArray, true: IntArray) -> dict[str, FloatArray]:
    """Return the size of each row's conformal set and whether the truth is in it, also by label.

    Parameters
    ----------
    sets
        (rows, 1 + classes) whether 'none' and each tooth, or each kind of damage, is in the set.
    true
        (rows,) place of the true class, 0 for 'none'.
    """
    inside = sets[np.arange(len(true)), true].astype(float)
    return {
        "set_size": sets.sum(axis=1).astype(float),
        "set_coverage": inside,
        "set_coverage_damaged": np.where(true > 0, inside, np.nan),
        "set_coverage_healthy": np.where(true > 0, np.nan, inside),
    }
