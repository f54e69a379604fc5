"""``sigdb query``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    import pandas as pd


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

    result = open_database(database).sql(sql)
    if form == "parquet":
        if out is None and sys.stdout.isatty():
            raise click.UsageError("Parquet is binary; give --out FILE or send the output to a file.")
        content = result.to_parquet(index=False)
    else:
        content = f"{_text(result, form)}\n".encode()
    if out is None:
        click.get_binary_stream("stdout").write(content)
    else:
        out.write_bytes(content)


def _text(result: "pd.DataFrame", form: str) -> str:
    if form == "csv":
        return result.to_csv(index=False).removesuffix("\n")
    if form == "json":
        return result.to_json(orient="records", double_precision=15)
    return f"{result.to_string(index=False, max_rows=60)}\n({len(result)} rows)"
