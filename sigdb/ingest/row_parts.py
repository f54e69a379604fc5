"""Parts of a database of recordings: rows become Arrow tables, piece by piece."""

import itertools
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from sigdb.database import ROW_GROUP, Receipt, Schema, Store, read_schema, write_part
from sigdb.ingest.findings import Finding, read_findings, with_findings
from sigdb.ingest.plan import PART_ROWS, IngestPlan
from sigdb.ingest.recorded_rows import Row, recording_rows


def make_recording_part(plan: IngestPlan, store: Store, part: int) -> Receipt:
    """Make the rows of the recordings of a part, and write their features and signals."""
    started = time.perf_counter()
    pieces = part_pieces(plan, read_schema(store), read_findings(store), part)
    return write_part(store, "rows", part, pieces, plan=plan.hash, first=part * PART_ROWS, started=started)


def part_pieces(
    plan: IngestPlan, schema: Schema, findings: Sequence[Finding], part: int
) -> Iterator[dict[str, pa.Table]]:
    """Yield the tables ``features`` and ``signals`` of a part, a row group of signals at a time."""
    rows = itertools.chain.from_iterable(recording_rows(plan, each) for each in plan.recordings_of(part))
    numbered = ({"id": part * PART_ROWS + i} | row for i, row in enumerate(rows))
    while some := list(itertools.islice(numbered, ROW_GROUP["signals"])):
        features, signals = (as_table(some, schema.arrow(table)) for table in ("features", "signals"))
        yield {"features": with_findings(features, findings), "signals": signals}


def as_table(rows: Iterable[Row], schema: pa.Schema) -> pa.Table:
    """Return rows as a table with the columns of a schema."""
    rows = list(rows)
    return pa.table([_column([row.get(field.name) for row in rows], field.type) for field in schema], schema=schema)


def _column(values: list[Any], type: pa.DataType) -> pa.Array:
    """Return a column; null where a value is None or nan."""
    if not pa.types.is_list(type):
        return pa.array(values, type, from_pandas=True)
    lengths = [0 if each is None else np.size(each) for each in values]
    flat = [np.asarray(each, dtype=np.float32) for each in values if each is not None]
    return pa.ListArray.from_arrays(
        pa.array(np.concatenate([[0], np.cumsum(lengths)]), pa.int32()),
        pa.array(np.concatenate(flat) if flat else np.empty(0, np.float32)),
        type=type,
        mask=pa.array([each is None for each in values]),
    )
