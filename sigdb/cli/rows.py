"""Rows as CSV, JSON, Parquet or a table, written as they come."""

import csv
import io
import json
import math
import textwrap
from collections import deque
from typing import IO, TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import pyarrow as pa

    from sigdb.recognition import Evaluation


FORMATS = ("table", "csv", "json", "parquet")
_SHOWN = 30
"""Rows of a table that are shown at its beginning, and at its end."""


def write_rows(reader: "pa.RecordBatchReader", form: str, sink: IO[bytes]) -> None:
    """Write batches of rows in one of :data:`FORMATS`; but for the few that it shows, none is kept."""
    {"table": _table, "csv": _csv, "json": _json, "parquet": _parquet}[form](reader, sink)


def _parquet(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    import pyarrow.parquet as pq

    with pq.ParquetWriter(sink, reader.schema) as writer:
        for batch in reader:
            writer.write_batch(batch)


def _csv(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    text = io.TextIOWrapper(sink, encoding="utf-8", newline="", write_through=True)
    writer = csv.writer(text, lineterminator="\n")
    try:
        writer.writerow(reader.schema.names)
        for batch in reader:
            for row in batch.to_pylist():
                plain = (_plain(value) for value in row.values())
                writer.writerow(json.dumps(value) if isinstance(value, list) else value for value in plain)
    finally:
        text.detach()  # else the sink is closed with it


def _json(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    between = "["
    for batch in reader:
        for row in batch.to_pylist():
            plain = {name: _plain(value) for name, value in row.items()}
            sink.write(f"{between}{json.dumps(plain, default=str)}".encode())
            between = ", "
    sink.write(b"]\n" if between == ", " else b"[]\n")


def _table(reader: "pa.RecordBatchReader", sink: IO[bytes]) -> None:
    import pyarrow as pa

    rows = 0
    first: list[pa.RecordBatch] = []
    last: deque[pa.RecordBatch] = deque(maxlen=_SHOWN)
    for batch in reader:
        # One more than is shown at the beginning: pandas then shows that rows are left out.
        begin = max(0, min(batch.num_rows, _SHOWN + 1 - rows))
        first.append(batch.slice(0, begin))
        rest = batch.slice(begin)
        last.extend(rest.slice(i, 1) for i in range(max(0, rest.num_rows - _SHOWN), rest.num_rows))
        rows += batch.num_rows
    shown = pa.Table.from_batches([*first, *last], reader.schema).to_pandas()
    sink.write(f"{shown.to_string(index=False, max_rows=2 * _SHOWN)}\n({rows} rows)\n".encode())


def _plain(value: Any) -> Any:
    """A value for JSON, which knows neither nan nor infinity."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_evaluation(evaluation: "Evaluation") -> None:
    """Print an evaluation as aligned text."""
    from sigdb.recognition import bound_text, criteria_table, efficiency_cells, limitation_texts, metric_table

    rows = f"{evaluation.rows} rows of {evaluation.specimens} specimens"
    click.echo(f"{evaluation.target}: {rows}. {evaluation.split}, {evaluation.split_text}.")
    _print_table(metric_table(evaluation).lines)
    click.echo(f"In brackets: 95 % interval, bootstrap over specimens. {bound_text(evaluation)}")
    if efficiency := efficiency_cells(evaluation):
        click.echo("\nAgainst the best possible, by signal-to-noise ratio of one revolution:")
        _print_table(efficiency.lines)
    for text in limitation_texts(evaluation):
        click.echo(textwrap.fill(text, 120, subsequent_indent="  "))
    if criteria := criteria_table(evaluation):
        click.echo("\nCriteria:")
        lines = criteria.lines
        _print_table([line[:-1] for line in lines])
        for title, *_, why in lines[1:]:
            if why:
                click.echo(textwrap.fill(f"{title}: {why}", 120, subsequent_indent="  "))


def _print_table(rows: list[list[str]]) -> None:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        click.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
