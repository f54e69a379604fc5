"""Comparison of parts with a sample of templates and of noise blocks that is made again, bit for bit."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from threadpoolctl import threadpool_limits

from sigdb.core import NOISE_BLOCK, DatabaseError
from sigdb.database import (
    DIGESTS,
    ROW_GROUP,
    CheckedParquet,
    IntegrityFinding,
    PartKey,
    Receipt,
    Schema,
    Store,
    StoredDigests,
    damaged_part,
    differing_columns,
)
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.work.rows import make_rows
from sigdb.sweep.work.stored_schema import computable_columns, holds_these_equations
from sigdb.sweep.work.templates import template_table


def remake_sample(
    store: Store,
    parts: Mapping[PartKey, tuple[Plan, Receipt]],
    schema: Schema,
    sample: int,
    doubtful: Iterable[tuple[PartKey, int]],
) -> Iterator[IntegrityFinding]:
    """Make a sample of templates and blocks of rows again, and yield the parts in which one differs.

    Parameters
    ----------
    store
        Where the database lies.
    parts
        Parts whose files are as they were written.
    schema
        Columns of the database. Those that this version does not compute are left out. Templates of an earlier version
        that obey other equations are not made again; rows are.
    sample
        Number of templates, and of blocks of 256 rows, to make again; they are spread evenly over the database.
    doubtful
        Rows, by part and id, whose blocks are made again too.
    """
    blocks = [(key, row - row % NOISE_BLOCK) for key, row in doubtful if key in parts]
    templates = _spread(parts, "templates", 1, sample) if holds_these_equations(schema) else []
    chosen = [(place, _differing_template) for place in templates] + [
        (place, _differing_block) for place in dict.fromkeys([*_spread(parts, "rows", NOISE_BLOCK, sample), *blocks])
    ]
    damaged: set[PartKey] = set()
    for (key, first), differing in chosen:
        plan, receipt = parts[key]
        if key not in damaged and (what := differing(store, plan, computable_columns(schema, plan), receipt, first)):
            damaged.add(key)
            yield damaged_part(key, *what)


def _spread(
    parts: Mapping[PartKey, tuple[Plan, Receipt]], stage: str, size: int, sample: int
) -> list[tuple[PartKey, int]]:
    """Return some templates or blocks, from the first to the last: part, and number or first id."""
    places = [
        (key, first)
        for key, (_, receipt) in parts.items()
        if key[0] == stage
        for first in range(receipt.first, receipt.first + receipt.rows, size)
    ]
    at = np.linspace(0, len(places) - 1, min(sample, len(places))).round().astype(int)
    return [places[i] for i in at]


Difference = tuple[str, str] | None
"""The name of a file, and the difference in it."""


def _differing_template(store: Store, plan: Plan, schema: Schema, receipt: Receipt, number: int) -> Difference:
    group, row = divmod(number - receipt.first, ROW_GROUP["templates"])
    with threadpool_limits(1):
        again = template_table(plan, schema, receipt.part, [number])
    stored = CheckedParquet(store, receipt.file("templates")).read([group]).slice(row, 1)
    return _difference(receipt, "templates", stored, again, f"template {number}")


def _differing_block(store: Store, plan: Plan, schema: Schema, receipt: Receipt, first: int) -> Difference:
    stop = min(first + NOISE_BLOCK, receipt.first + receipt.rows)
    try:
        with threadpool_limits(1):
            (again,) = make_rows(plan, store, schema, first, stop)
    except DatabaseError:
        return None  # its templates are damaged, which is a finding already
    if receipt.is_virtual:
        digests = StoredDigests(CheckedParquet(store, receipt.file(DIGESTS)))
        kinds = [some for content in again.values() for some in differing_columns(content, first, digests)]
        return _sentence(receipt, DIGESTS, [name for some in kinds for name in some], f"rows {first} to {stop - 1}")
    for table, content in again.items():
        group, row = divmod(first - receipt.first, ROW_GROUP[table])
        stored = CheckedParquet(store, receipt.file(table)).read([group]).slice(row, stop - first)
        if what := _difference(receipt, table, stored, content, f"rows {first} to {stop - 1}"):
            return what
    return None


def _difference(receipt: Receipt, table: str, stored: pa.Table, again: pa.Table, rows: str) -> Difference:
    columns = [name for name in again.schema.names if _encode(stored, name) != _encode(again, name)]
    return _sentence(receipt, table, columns, rows)


def _sentence(receipt: Receipt, table: str, columns: Sequence[str], rows: str) -> Difference:
    if not columns:
        return None
    more = f" and {len(columns) - 1} more columns" if len(columns) > 1 else ""
    return receipt.file(table).path, f"{rows}: {columns[0]}{more} are not what making them again gives"


def _encode(table: pa.Table, column: str) -> bytes:
    """Return a column as bytes, which depend on its values only, not on their place in memory.

    A status counts only by whether there is a result. Another version may give the reason in other words.
    """
    if column == "status":
        return bytes(pc.equal(table[column], "ok").to_numpy())
    sink = pa.BufferOutputStream()
    pq.write_table(table.select([column]), sink, compression="none", use_dictionary=False, write_statistics=False)
    return bytes(sink.getvalue())
