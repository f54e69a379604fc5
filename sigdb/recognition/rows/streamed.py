"""Rows of a database with what is learnt from, streamed: arrays are read, used and forgotten a batch at a time."""

from collections.abc import Collection, Iterable, Iterator
from typing import Any, Protocol

import numpy as np
import pandas as pd
import pyarrow as pa

from sigdb.core import FloatArray, InputError
from sigdb.database import Database, suffixed
from sigdb.recognition.rows.row_matrix import as_matrix, matrix_column
from sigdb.recognition.templates.scores import TemplateScores

ROWS_AT_ONCE = 4096
"""Rows whose arrays are in memory at once."""


class Reducer(Protocol):
    """What makes a few numbers of an average."""

    column: str
    """Name of the column that they are kept in."""

    def transform(self, X: pd.DataFrame) -> FloatArray:
        """(rows, k) of rows with their averages ``tsa``."""
        ...


def reduced(reducer: Reducer, X: pd.DataFrame) -> FloatArray:
    """(rows, k) what a reducer makes of rows: the column of it where there is one."""
    return as_matrix(X[reducer.column]) if reducer.column in X else reducer.transform(X)


def reducers_of(estimators: Iterable[Any]) -> dict[str, Reducer]:
    """By column, what reduces averages to what estimators read."""
    found = [reducer_of(one) for one in estimators]
    return {one.column: one for one in found if one is not None}


def reducer_of(estimator: Any) -> Reducer | None:
    """What reduces averages to what an estimator reads; None where it reads none."""
    if hasattr(estimator, "scorer"):
        return reducer_of(estimator.scorer)
    if hasattr(estimator, "reducer"):
        one: Reducer | None = estimator.reducer
        return one
    return TemplateScores(estimator.bank, estimator.n_jobs) if hasattr(estimator, "bank") else None


def with_reduced(
    database: Database,
    rows: pd.DataFrame,
    reducers: dict[str, Reducer],
    *,
    sensor: str,
    needed: Collection[str] | None = None,
) -> pd.DataFrame:
    """Rows, by id, with a column for each reducer: a list of numbers a row, in double precision.

    Parameters
    ----------
    database
        Where the rows are from.
    rows
        By id, with what the reducers read beside ``tsa``.
    reducers
        By column.
    sensor
        Whose averages.
    needed
        Columns without which there is nothing to go on with; all if left out. Of the others those that cannot be made
        of these rows are left out.

    Raises
    ------
    InputError
        If a needed column cannot be made.
    """
    left = dict(reducers)
    found: dict[str, FloatArray] = {}
    for at, batch in (
        _batches(database, rows, "signals", suffixed("tsa", database.sensors, sensor), "tsa") if left else ()
    ):
        for column, reducer in list(left.items()):
            try:
                values = reducer.transform(batch)
            except InputError:
                if needed is None or column in needed:
                    raise
                del left[column]
                continue
            if column not in found:
                found[column] = np.full((len(rows), values.shape[1]), np.nan)
            found[column][at] = values
    if left and not found:
        raise InputError(f"{database.store} has no averages of these rows; keep rows whose status is 'ok'")
    return rows.assign(**{column: matrix_column(found[column], rows.index) for column in left})


def feature_batches(database: Database, rows: pd.DataFrame) -> Iterator[tuple[np.ndarray, pd.DataFrame]]:
    """Rows, by id, with their pooled features ``wigner_ville``, some at a time, and their places."""
    return _batches(database, rows, "features", "wigner_ville", "wigner_ville")


def with_features(database: Database, rows: pd.DataFrame) -> pd.DataFrame:
    """Rows, not too many of them, by id, with their pooled features ``wigner_ville``."""
    parts = [batch for _, batch in feature_batches(database, rows)]
    if not parts:
        raise InputError(f"{database.store} has no features of these rows; keep rows whose status is 'ok'")
    return pd.concat(parts).loc[rows.index]


def with_averages(database: Database, rows: pd.DataFrame, *, sensor: str) -> pd.DataFrame:
    """A few rows, by id, with their averages ``tsa``."""
    return rows.assign(tsa=[database.signals([one], sensor=sensor)["tsa"][0] for one in rows.index])


def _batches(
    database: Database, rows: pd.DataFrame, table: str, column: str, name: str
) -> Iterator[tuple[np.ndarray, pd.DataFrame]]:
    """Rows with a column of arrays, in the database's order, and the places that they have among all."""
    if rows.empty:
        return
    where = f"status = 'ok' and id between {rows.index.min()} and {rows.index.max()}"
    reader = database.batches(where, table=table, columns=["id", column], rows=ROWS_AT_ONCE)
    places: list[np.ndarray] = []
    arrays: list[np.ndarray] = []
    for batch in _drained(reader):
        at = rows.index.get_indexer(batch["id"].to_numpy())
        wanted = np.flatnonzero(at >= 0)
        if sum(map(len, places)) + len(wanted) > ROWS_AT_ONCE:
            yield _gathered(rows, places, arrays, name)
            places, arrays = [], []
        if wanted.size:
            places.append(at[wanted])
            arrays.append(batch[column].take(pa.array(wanted)).to_numpy(zero_copy_only=False))
    if places:
        yield _gathered(rows, places, arrays, name)


def _gathered(
    rows: pd.DataFrame, places: list[np.ndarray], arrays: list[np.ndarray], name: str
) -> tuple[np.ndarray, pd.DataFrame]:
    """Rows of several batches, of which few may be wanted: estimators are quicker with many rows at once."""
    at = np.concatenate(places)
    return at, rows.iloc[at].assign(**{name: np.concatenate(arrays)})


def _drained(reader: pa.RecordBatchReader) -> Iterator[pa.RecordBatch]:
    """Batches of a reader, which is read to its end also where its reading is given up.

    A reader that is left in the middle goes on reading in the background, and stops the interpreter from ending.
    """
    try:
        yield from reader
    finally:
        for _ in reader:
            pass
