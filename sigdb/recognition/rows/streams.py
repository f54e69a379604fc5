"""Streams of rows of a database: arrays are read, used and forgotten a batch at a time."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from sigdb.core import FloatArray, InputError, IntArray, NotApplicableError
from sigdb.database import MEASURED_SENSOR, Database, suffixed
from sigdb.recognition.rows.batch import BY_ORDER, CELLS, ROWS_AT_ONCE, TSA, Batch, Matrices, Reducer


def stream_averages(database: Database, rows: Batch, *, sensor: str) -> Iterator[tuple[IntArray, Batch]]:
    """Yield rows with the averages of a sensor, some at a time, with their places among all.

    Parameters
    ----------
    database
        Where the rows are from.
    rows
        By id.
    sensor
        A stored sensor.
    """
    stored = suffixed(TSA, database.sensors, sensor_in(database, sensor))
    by_order = suffixed(BY_ORDER, database.sensors, sensor_in(database, sensor))
    columns = [stored, *([by_order] if knows_noise_by_order(database) else [])]
    for places, (tsa, *noise) in _stream(database, rows, "signals", columns):
        yield places, replace(rows.take(places), tsa=tsa, noise_by_order=noise[0] if noise else None)


def knows_noise_by_order(database: Database) -> bool:
    """Return whether a database holds the noise of its averages by order, as that of recordings does."""
    return BY_ORDER in database.dataset("signals").schema.names


def sensor_in(database: Database, sensor: str) -> str:
    """Return the sensor of a database whose averages a model reads.

    A model of simulated rows reads those of recordings, and the other way round: the first sensor of the database.
    """
    across = database.manifest.is_measured or sensor == MEASURED_SENSOR
    return database.sensors[0] if across else database.stored_sensor(sensor)


def stream_features(database: Database, rows: Batch) -> Iterator[tuple[IntArray, Batch]]:
    """Yield rows, by id, with their pooled features, some at a time, with their places among all."""
    for places, (cells,) in _stream(database, rows, "features", [CELLS]):
        yield places, replace(rows.take(places), features=cells)


def reduce_averages(
    database: Database,
    rows: Batch,
    reducers: Mapping[str, Reducer],
    *,
    sensor: str,
    needed: Collection[str] | None = None,
) -> Batch:
    """Return rows with what reducers make of their averages, which are read and forgotten.

    Parameters
    ----------
    database
        Where the rows are from.
    rows
        By id, with the scalars that the reducers read.
    reducers
        By name.
    sensor
        Whose averages.
    needed
        Names of the reducers that must apply to these rows; all if left out. Others that do not apply are left out.

    Raises
    ------
    NotApplicableError
        If a needed reducer does not apply to the rows.
    InputError
        If the database has no such sensor, or no averages of the rows.
    """
    left = dict(reducers)
    reduced: dict[str, FloatArray] = {}
    for places, batch in stream_averages(database, rows, sensor=sensor) if left else ():
        for name, reducer in list(left.items()):
            try:
                values = reducer.transform(batch)
            except NotApplicableError:
                if needed is None or name in needed:
                    raise
                del left[name]
                continue
            if name not in reduced:
                reduced[name] = np.full((len(rows), values.shape[1]), np.nan)
            reduced[name][places] = values
    if left and not reduced:
        raise InputError(f"{database.store} has no averages of these rows; keep rows whose status is 'ok'")
    return replace(rows, reduced={**rows.reduced, **{name: reduced[name] for name in left}})


def read_features(database: Database, rows: Batch) -> Batch:
    """Return rows, not too many of them, by id, with their pooled features."""
    return _joined(database, rows, stream_features(database, rows), "features")


def _joined(database: Database, rows: Batch, stream: Iterator[tuple[IntArray, Batch]], name: str) -> Batch:
    """Return rows with the arrays of a stream, in their order."""
    parts = list(stream)
    if sum(len(places) for places, _ in parts) < len(rows):
        raise InputError(f"{database.store} has no {name} of these rows; keep rows whose status is 'ok'")
    places = np.concatenate([places for places, _ in parts])
    arrays: dict[str, Any] = {}
    for field in ("tsa", "features", "noise_by_order"):
        matrices = [getattr(batch, field) for _, batch in parts]
        if any(each is not None for each in matrices):
            arrays[field] = _concatenate(matrices)
    return replace(rows.take(places), **arrays).take(np.argsort(places))


def read_averages(database: Database, rows: Batch, *, sensor: str) -> Batch:
    """Return rows, not too many of them, by id, with the averages of a sensor."""
    return _joined(database, rows, stream_averages(database, rows, sensor=sensor), "averages")


def _stream(
    database: Database, rows: Batch, table: str, columns: Sequence[str]
) -> Iterator[tuple[IntArray, list[Matrices]]]:
    """Yield places of rows and their arrays, of each column, in the database's order."""
    if not len(rows):
        return
    index, teeth = rows.index, rows.table["teeth"].to_numpy(int)
    where = f"status = 'ok' and id between {index.min()} and {index.max()}"
    reader = database.batches(where, table=table, columns=["id", *columns], rows=ROWS_AT_ONCE)
    places: list[IntArray] = []
    arrays: list[list[Matrices]] = []
    for batch in _drain(reader):
        at = index.get_indexer(batch["id"].to_numpy())
        wanted = np.flatnonzero(at >= 0)
        # Batches of which few rows are wanted are joined: estimators are quicker with many rows at once.
        if sum(map(len, places)) + len(wanted) > ROWS_AT_ONCE:
            yield np.concatenate(places), _concatenate_columns(arrays)
            places, arrays = [], []
        if wanted.size:
            places.append(at[wanted])
            arrays.append([_matrices(batch[name].take(pa.array(wanted)), teeth[at[wanted]]) for name in columns])
    if places:
        yield np.concatenate(places), _concatenate_columns(arrays)


def _concatenate_columns(parts: Sequence[Sequence[Matrices]]) -> list[Matrices]:
    """Return the matrices of several parts, one below the other, for each column."""
    return [_concatenate(column) for column in zip(*parts, strict=True)]


def _matrices(lists: pa.ListArray, teeth: IntArray) -> dict[int, FloatArray]:
    """Return lists as a matrix for each tooth count; nan where a row has none."""
    some = {int(count): lists.take(pa.array(np.flatnonzero(teeth == count))) for count in np.unique(teeth)}
    return {count: _matrix(chosen) for count, chosen in some.items()}


def _matrix(lists: pa.ListArray) -> FloatArray:
    values = lists.flatten().to_numpy(zero_copy_only=False)
    present = np.asarray(lists.value_lengths().fill_null(0)) > 0
    if present.all():
        return values.reshape(len(lists), -1)
    matrix = np.full((len(lists), len(values) // max(int(present.sum()), 1)), np.nan)
    matrix[present] = values.reshape(int(present.sum()), matrix.shape[1])
    return matrix


def _concatenate(parts: Sequence[Matrices | None]) -> dict[int, FloatArray]:
    """Return the matrices of several parts, one below the other; nan for what some rows have not."""
    present = [part for part in parts if part is not None]
    counts = sorted({count for part in present for count in part})
    stacked = {}
    for count in counts:
        some = [part[count] for part in present if count in part]
        width = max(matrix.shape[1] for matrix in some)
        lacking = [width - matrix.shape[1] for matrix in some]
        wide = [
            np.pad(matrix, ((0, 0), (0, more)), constant_values=np.nan) if more else matrix
            for matrix, more in zip(some, lacking, strict=True)
        ]
        stacked[count] = np.concatenate(wide)
    return stacked


def _drain(reader: pa.RecordBatchReader) -> Iterator[pa.RecordBatch]:
    """Yield the batches of a reader, which is read to its end also where its reading is given up.

    A reader that is left in the middle goes on reading in the background, and stops the interpreter from ending.
    """
    try:
        yield from reader
    finally:
        for _ in reader:
            pass
