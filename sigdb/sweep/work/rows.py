"""Rows of a sweep: averages of the stored templates and their features, as columns."""

import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from threadpoolctl import ThreadpoolController

from sigdb.core import NOISE_BLOCK, BoolArray, FloatArray, IntArray, noise_stream
from sigdb.database import DIGESTS, Receipt, Schema, Store, block_digests, read_schema, suffixed, write_part
from sigdb.signature import FEATURES, features
from sigdb.sweep.plan.make_plan import plan_from
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.averages import CASE_COLUMNS, Averages, Cases, SpecimenErrors
from sigdb.sweep.work.templates import TemplateReader


def make_row_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Make the rows of a part from the stored templates, and write their features and signals."""
    started = time.perf_counter()
    start, stop = plan.row_range(part)
    pieces = make_rows(plan, store, read_schema(store), start, stop)
    return write_part(store, "rows", part, pieces, plan=plan.hash, first=start, started=started)


def make_virtual_part(plan: Plan, store: Store, part: int) -> Receipt:
    """Make the rows of a part from the stored templates, and write their digests in place of them."""
    started = time.perf_counter()
    start, stop = plan.row_range(part)
    pieces = make_rows(plan, store, read_schema(store), start, stop)
    return write_part(store, "rows", part, pieces, plan=plan.hash, first=start, started=started, stored=row_digests)


def row_digests(block: Mapping[str, pa.Table]) -> dict[str, pa.Table]:
    """Return the table of digests of a noise block."""
    return {DIGESTS: block_digests(block, block["features"]["id"][0].as_py())}


def make_rows(plan: Plan, store: Store, schema: Schema, start: int, stop: int) -> Iterator[dict[str, pa.Table]]:
    """Yield the tables ``features`` and ``signals`` of rows ``start`` to ``stop - 1``, by noise block.

    ``start`` begins a noise block. The tables have the columns of ``schema``.
    """
    schemas = {table: schema.arrow(table) for table in ("features", "signals")}
    return _Blocks(plan, store).make(schemas, start, stop)


class StoredRows:
    """Maker of the rows of a database from its templates, bit for bit as its sweep makes them.

    Parameters
    ----------
    store
        Where the database lies.
    resolved
        The resolved recipe of its plan.
    """

    def __init__(self, store: Store, resolved: Mapping[str, Any]) -> None:
        self._plan, self._schema = plan_from(dict(resolved)), read_schema(store)
        self._blocks, self._lock = _Blocks(self._plan, store), threading.Lock()
        # Searched here: a search in a thread of a query may wait for ever, as it locks the loader of libraries.
        self._pools = ThreadpoolController()
        # Index errors are planned, but not of rows that lose contact.
        self.planned = frozenset(map(str, self._plan.table(*self._first_row).columns)) - {"index_error"}

    @property
    def _first_row(self) -> tuple[int, int]:
        return self._plan.first_row, self._plan.first_row + 1

    def table(self, table: str, first: int, stop: int, columns: Sequence[str]) -> Iterator[pa.Table]:
        """Yield columns of a table of rows ``first`` to ``stop - 1``, by noise block; ``first`` begins a block.

        Only what the columns need is computed, in one thread of linear algebra, as in a sweep.
        """
        every = self._schema.arrow(table)
        schema = pa.schema([every.field(name) for name in columns])
        if self.planned.issuperset(columns):
            cases = self.cases(first, stop, columns)
            yield from (cases.slice(at, NOISE_BLOCK) for at in range(0, stop - first, NOISE_BLOCK))
            return
        for block in range(first, stop, NOISE_BLOCK):
            with self._lock, self._pools.limit(limits=1):
                (tables,) = self._blocks.make({table: schema}, block, min(block + NOISE_BLOCK, stop))
            yield tables[table]

    def cases(self, first: int, stop: int, columns: Sequence[str]) -> pa.Table:
        """Return planned columns of rows ``first`` to ``stop - 1``."""
        every = self._schema.arrow("features")
        schema = pa.schema([every.field(name) for name in columns])
        return pa.table(_planned(self._plan.table(first, stop), schema), schema=schema)


def _planned(cases: pd.DataFrame, schema: pa.Schema) -> dict[str, pa.Array]:
    """Return the columns of a schema that cases have."""
    return {
        field.name: pa.array(cases[field.name], field.type, from_pandas=True) for field in schema if field.name in cases
    }


class _Blocks:
    """Maker of noise blocks, which keeps the templates and specimens that it used last."""

    def __init__(self, plan: Plan, store: Store) -> None:
        self._plan = plan
        self._templates = TemplateReader(store, plan.sensors)
        self._errors = SpecimenErrors(plan.seed, plan.design.runout)

    def make(self, schemas: Mapping[str, pa.Schema], start: int, stop: int) -> Iterator[dict[str, pa.Table]]:
        """Yield the columns of some tables of rows ``start`` to ``stop - 1``, by noise block."""
        plan, planned = self._plan, self._plan.table(start, stop)
        columns = {name: column for schema in schemas.values() for name, column in _planned(planned, schema).items()}
        cases = {name: planned[name].to_numpy() for name in CASE_COLUMNS}
        stored = {field.name.partition("__")[0] for schema in schemas.values() for field in schema}
        names = [name for name in FEATURES if name in stored]
        for first in range(start, stop, NOISE_BLOCK):
            some = slice(first - start, first - start + NOISE_BLOCK)
            stream = noise_stream(plan.seed, plan.hash, first // NOISE_BLOCK)
            here = {name: values[some] for name, values in cases.items()}
            block = _block(plan, self._templates, self._errors, here, stream, names)
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
    plan: Plan,
    templates: TemplateReader,
    errors: SpecimenErrors,
    cases: Cases,
    stream: np.random.Generator,
    names: Sequence[str],
) -> pa.Table:
    """Return the results of the rows of a noise block; noise is drawn by tooth count, in the order of the rows."""
    places = [np.flatnonzero(cases["teeth"] == teeth) for teeth in np.unique(cases["teeth"])]
    tables = [
        _columns(
            plan,
            Averages(plan, templates, errors, {name: values[rows] for name, values in cases.items()}, stream),
            names,
        )
        for rows in places
    ]
    if len(tables) == 1:
        return tables[0]
    return pa.concat_tables(tables, promote_options="default").take(np.argsort(np.concatenate(places))).combine_chunks()


def _columns(plan: Plan, averages: Averages, names: Sequence[str]) -> pa.Table:
    """Return status, averages and some of their features as columns."""
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
    if len(tsa) and names:
        results |= _signature(tsa, averages.teeth, names)
    for i, sensor in enumerate(plan.sensors):
        for name, values in results.items():
            column = _lists if values.ndim == 3 else _numbers
            columns[suffixed(name, plan.sensors, sensor)] = column(values[:, i], done)
    return pa.table(columns)


def _signature(tsa: FloatArray, teeth: int, names: Sequence[str]) -> dict[str, FloatArray]:
    """Return some features of averages (rows, sensors, n): (rows, sensors) or (rows, sensors, length) each."""
    return {
        name: values.reshape(*tsa.shape[:2], -1) if FEATURES[name].axes else values
        for name, values in features(tsa, teeth=teeth, names=names).items()
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
