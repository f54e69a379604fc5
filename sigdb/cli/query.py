"""``sigdb query``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


@click.command()
@click.argument("database", metavar="DB")
@click.argument("sql")
@click.option(
    "--format", "form", type=click.Choice(["table", "csv", "json", "parquet"]), default="table", show_default=True
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
    content = _parquet(result) if form == "parquet" else f"{_text(result.to_pandas(), form)}\n".encode()
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


def _text(result: "pd.DataFrame", form: str) -> str:
    if form == "csv":
        return str(result.to_csv(index=False)).removesuffix("\n")
    if form == "json":
        return str(result.to_json(orient="records", double_precision=15))
    return f"{result.to_string(index=False, max_rows=60)}\n({len(result)} rows)"
