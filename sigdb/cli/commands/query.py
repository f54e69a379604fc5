"""``sigdb query``."""

import sys
from pathlib import Path

import click

from sigdb.cli.options.format import format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.rows import FORMATS, write_rows

_ROWS_AT_ONCE = 8192
"""Rows that are read before they are written."""


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("sql")
@format_option(*FORMATS, of="the rows")
@click.option("--out", type=click.Path(path_type=Path), help="Write to this file instead of the terminal.")
def query(database: str, sql: str, form: str, out: Path | None) -> None:
    """Query a database with one SELECT statement.

    The views are features (all columns of a row), cases (the same without lists), signals and templates. Rows are
    written as they come, so a result may be larger than memory.

    \b
    Example:
      sigdb query DB "select tooth, avg(fm4) from features group by tooth"
    """
    from sigdb.database import open as open_database

    rows = open_database(database).stream(sql, rows=_ROWS_AT_ONCE)
    if out is not None:
        with out.open("wb") as file:
            write_rows(rows, form, file)
    elif form == "parquet" and sys.stdout.isatty():
        raise click.UsageError("Parquet is binary; give --out FILE or send the output to a file.")
    else:
        write_rows(rows, form, sys.stdout.buffer)
