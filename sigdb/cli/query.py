"""``sigdb query``."""

import csv
import io
import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    import pyarrow as pa


@click.command()
@click.argument("database", metavar="DB")
@click.argument("sql")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "csv", "json", "parquet"]),
    default="table",
    show_default=True,
    help="How the rows are written.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Write to this file instead of the terminal.")
def query(database: str, sql: str, form: str, out: Path | None) -> None:
    """Ask a database with one SELECT statement.

    The views are features (all columns of a row), cases (the same without lists), signals and templates.

    Example: sigdb query DB "select tooth, avg(fm4) from features group by tooth"
    """
    from sigdb.database import open as open_database

    result = open_database(database).arrow(sql)
    if form == "parquet" and out is None and sys.stdout.isatty():
        raise click.UsageError("Parquet is binary; give --out FILE or send the output to a file.")
    content = _parquet(result) if form == "parquet" else f"{_text(result, form)}\n".encode()
    if out is None:
        sys.stdout.buffer.write(content)
    else:
        out.write_bytes(content)


def _parquet(result: "pa.Table") -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    sink = pa.BufferOutputStream()
    pq.write_table(result, sink)
    return bytes(sink.getvalue().to_pybytes())


def _text(result: "pa.Table", form: str) -> str:
    if form == "table":
        return f"{result.to_pandas().to_string(index=False, max_rows=60)}\n({result.num_rows} rows)"
    rows = [{name: _plain(value) for name, value in row.items()} for row in result.to_pylist()]
    if form == "json":
        return json.dumps(rows, default=str)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(result.column_names)
    for row in rows:
        writer.writerow(json.dumps(value) if isinstance(value, list) else value for value in row.values())
    return text.getvalue().removesuffix("\n")


def _plain(value: Any) -> Any:
    """A value for JSON, which knows neither nan nor infinity."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
