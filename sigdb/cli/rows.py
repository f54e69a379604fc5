"""Rows as CSV, JSON, Parquet or a table, written as they come."""

import csv
import io
import json
from collections import deque
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa

FORMATS = ("table", "csv", "json", "parquet")
_SHOWN = 30
"""Rows of a table that are shown at its beginning, and at its end."""


def write_rows(reader: "pa.RecordBatchReader", form: str, sink: IO[bytes]) -> None:
    """Write batches of rows in one of :data:`FORMATS`; only the few rows of a table are kept in memory."""
    {"table": _table, "csv": _csv, "json": _json, "parquet": _parquet}[form](reader, sink)


def _parquet(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    import pyarrow.parquet as pq

    with pq.ParquetWriter(sink, reader.schema) as writer:
        for batch in reader:
            writer.write_batch(batch)


def _csv(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    from sigdb.core import visible_text

    text = io.TextIOWrapper(sink, encoding="utf-8", newline="", write_through=True)
    shown = visible_text if sink.isatty() else str  # a file and a pipe get texts as they are
    writer = csv.writer(text, lineterminator="\n")
    try:
        writer.writerow([shown(name) for name in reader.schema.names])
        for batch in reader:
            for row in batch.to_pylist():
                values = (_plain(value) for value in row.values())
                values = (json.dumps(value) if isinstance(value, list) else value for value in values)
                writer.writerow(shown(value) if isinstance(value, str) else value for value in values)
    finally:
        text.detach()  # else the sink is closed with it


def _json(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    between = "["
    for batch in reader:
        for row in batch.to_pylist():
            values = {name: _plain(value) for name, value in row.items()}
            sink.write(f"{between}{json.dumps(values)}".encode())
            between = ", "
    sink.write(b"]\n" if between == ", " else b"[]\n")


def _table(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    from sigdb.report import Terminal, TextTable

    names, count = reader.schema.names, 0
    first: list[dict[str, Any]] = []
    last: deque[dict[str, Any]] = deque(maxlen=_SHOWN)
    for batch in reader:
        count += batch.num_rows
        room = min(_SHOWN - len(first), batch.num_rows)
        first += batch.slice(0, room).to_pylist()
        last.extend(batch.slice(max(room, batch.num_rows - _SHOWN)).to_pylist())
    dots = [dict.fromkeys(names, "...")] if count > 2 * _SHOWN else []
    text = TextTable.of_records(names, [*first, *dots, *last]).text(Terminal.of(sink))
    sink.write(f"{text}\n({count} rows)\n".encode())


def _plain(value: Any) -> Any:
    """Return a value as JSON can hold it; decimals, times of day and intervals become text."""
    from sigdb.core import plain

    try:
        return plain(value)
    except TypeError:
        return str(value)
