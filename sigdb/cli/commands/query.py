"""``sigdb query``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import format_option
from sigdb.cli.options.limits import limit_options
from sigdb.cli.options.places import DATABASE
from sigdb.cli.rows import FORMATS, write_rows

if TYPE_CHECKING:
    from sigdb.database import LimitOptions

_ROWS_AT_ONCE = 8192
"""Rows that are read before they are written."""


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("sql")
@format_option(*FORMATS, of="the rows")
@click.option("--out", type=click.Path(path_type=Path), help="Write to this file instead of the terminal.")
@limit_options("max_seconds", "max_memory_gb", "max_rows")
def query(database: str, sql: str, form: str, out: Path | None, limits: "LimitOptions") -> None:
    """Query a database with one SELECT statement.

    The views are features (all columns of a row), cases (the same without lists), signals and templates. Rows are
    written as they come, so a result may be larger than memory. A query reads no file, and ends at its limits.

    \b
    Example:
      sigdb query DB "select tooth, avg(fm4) from features group by tooth"
    """
    from sigdb.core import publish
    from sigdb.database import open as open_database

    if out is None and form == "parquet" and sys.stdout.isatty():
        raise click.UsageError("Parquet is binary; give --out FILE or send the output to a file.")
    with open_database(database) as opened:
        if opened.virtual_rows:
            click.echo(f"{database}: {opened.cost(sql)}", err=True)
        rows = opened.stream(sql, rows=_ROWS_AT_ONCE, **limits)
        if out is None:
            write_rows(rows, form, sys.stdout.buffer)
            return

        def write(place: Path) -> None:
            with place.open("wb") as file:
                write_rows(rows, form, file)

        publish(out, write)
