"""Rows of a sweep: averages of the stored templates and their features, as columns."""

import time
from collections.abc import Iterator

import numpy as np
import pyarrow as pa

from sigdb.core import NOISE_BLOCK, BoolArray, FloatArray, IntArray, noise_stream
from sigdb.database import Receipt, Schema, Store, read_schema, suffixed, write_part
from sigdb.signature import FEATURES, features
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.averages import CASE_COLUMNS, Averages, Cases, SpecimenErrors
from sigdb.sweep.work.templates import TemplateReader


def make_row_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Make the rows of a part from the stored templates, and write their features and signals."""
    started = time.perf_counter()
    start, stop = plan.row_range(part)
    pieces = make_rows(plan, store, read_schema(store), start, stop)
    return write_part(store, "rows", part, pieces, plan=plan.hash, first=start, started=started)


def make_rows(plan: Plan, store: Store, schema: Schema, start: int, stop: int) -> Iterator[dict[str, pa.Table]]:
    """Yield the tables ``features`` and ``signals`` of rows ``start`` to ``stop - 1``, by noise block.

    ``start`` begins a noise block. The tables have the columns of ``schema``.
    """
    templates, errors = TemplateReader(store, plan.sensors), SpecimenErrors(plan.seed, plan.design.runout)
    planned = plan.table(start, stop)
    schemas = {table: schema.arrow(table) for table in ("features", "signals")}
    columns = {
        field.name: pa.array(planned[field.name], field.type, from_pandas=True)
        for field in schemas["features"]
        if field.name in planned
    }
    cases = {name: planned[name].to_numpy() for name in CASE_COLUMNS}
    for first in range(start, stop, NOISE_BLOCK):
        some = slice(first - start, first - start + NOISE_BLOCK)
        stream = noise_stream(plan.seed, plan.hash, first // NOISE_BLOCK)
        block = _block(plan, templates, errors, {name: values[some] for name, values in cases.items()}, stream)
        values = dict(zip(block.column_names, block, strict=True))
        values |= {name: column[some] for name, column in columns.items() if name not in values}
        # A block without any result has no columns of a signature.
        yield {
            table: pa.table(
                [values.get(field.name, pa.nulls(block.num_rows, field.type)) for field in schema], schema=schema
            )
            for table, schema in schemas.items()
        }


def _block(
    plan: Plan, templates: TemplateReader, errors: SpecimenErrors, cases: Cases, stream: np.random.Generator
) -> pa.Table:
    """Return the results of the rows of a noise block; noise is drawn by tooth count, in the order of the rows."""
    places = [np.flatnonzero(cases["teeth"] == teeth) for teeth in np.unique(cases["teeth"])]
    tables = [
        _columns(
            plan, Averages(plan, templates, errors, {name: values[rows] for name, values in cases.items()}, stream)
        )
        for rows in places
    ]
    if len(tables) == 1:
        return tables[0]
    return pa.concat_tables(tables, promote_options="default").take(np.argsort(np.concatenate(places))).combine_chunks()


def _columns(plan: Plan, averages: Averages) -> pa.Table:
    """Return status and features of averages as columns."""
    done = averages.done
    columns = {
        "status": pa.array(averages.status, pa.string()),
        "status_code": pa.array(averages.status_code, pa.string()),
        "index_error": pa.array(averages.index_error),
        "min_compression": _numbers(averages.least, np.full(len(done), True)),
        "min_mesh_force": _numbers(averages.least_force, np.full(len(done), True)),
        "contact_loss": pa.array(averages.contact_loss, pa.bool_()),
    }
    tsa = averages.tsa[done]
    results: dict[str, FloatArray | IntArray] = {"scatter": averages.scatter[done], "tsa": tsa}
    if averages.noise is not None and averages.noise_colour is not None:
        results |= {"noise": averages.noise[done], "noise_colour": averages.noise_colour[done]}
    if len(tsa):
        results |= _signature(tsa, averages.teeth)
    for i, sensor in enumerate(plan.sensors):
        for name, values in results.items():
            column = _lists if values.ndim == 3 else _numbers
            columns[suffixed(name, plan.sensors, sensor)] = column(values[:, i], done)
    return pa.table(columns)


def _signature(tsa: FloatArray, teeth: int) -> dict[str, FloatArray]:
    """Return features of averages (rows, sensors, n): (rows, sensors) or (rows, sensors, length) each."""
    return {
        name: values.reshape(*tsa.shape[:2], -1) if FEATURES[name].axes else values
        for name, values in features(tsa, teeth=teeth).items()
    }


def _numbers(values: FloatArray | IntArray, done: BoolArray) -> pa.Array:
    """Return a column of the numbers of the rows that are done; null in others, and where a number is nan."""
    if values.dtype.kind == "i":
        column = np.zeros(len(done), np.int32)
        column[done] = values
        return pa.array(column, mask=~done)
    column = np.full(len(done), np.nan, dtype=np.float32)
    column[done] = values
    return pa.array(column, from_pandas=True)


def _lists(values: FloatArray | IntArray, done: BoolArray) -> pa.Array:
    """Return a column of the lists (rows that are done, length); null in others."""
    offsets = np.concatenate([[0], np.cumsum(done)]) * values.shape[1]
    return pa.ListArray.from_arrays(
        pa.array(offsets, pa.int32()),
        pa.array(np.ascontiguousarray(values, dtype=np.float32).ravel()),
        type=_LIST,
        mask=pa.array(~done),
    )


_LIST = pa.list_(pa.field("element", pa.float32()))
