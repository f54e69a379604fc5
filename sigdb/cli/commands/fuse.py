"""``sigdb fuse``."""

import sys

import click

from sigdb.cli.options.format import format_option
from sigdb.cli.options.places import DATABASE
from sigdb.cli.rows import write_rows


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option(
    "--model",
    "models",
    multiple=True,
    help="Folder or name of a model whose templates are the law, one for each sensor; by default the database's own.",
)
@click.option("--by", help="Column of DB that names the machine of a row; by default rows of one damage and specimen.")
@click.option("--where", help="Only rows that meet this SQL condition, for example 'snr_db > -10'.")
@click.option("--sensor", "sensors", multiple=True, help="Stored sensor; may be repeated. By default all.")
@click.option(
    "--over",
    help="Sources that are fused, of sensors, points and recordings, with commas between; by default all. Others make "
    "answers of their own.",
)
@format_option("table", "csv", "json", of="the answers")
def fuse(
    database: str,
    models: tuple[str, ...],
    by: str | None,
    where: str | None,
    sensors: tuple[str, ...],
    over: str | None,
    form: str,
) -> None:
    """Give one answer to each machine of a database from all its averages: sensors, operating points, recordings.

    The noise of averages is independent, and the index errors of a pair of gears are common to all its averages, which
    the answer takes into account. By the database's own templates the answers are the best that there can be, and their
    accuracy is shown. With --model they are those of trained models, and --by names the machines.

    \b
    Example:
      sigdb fuse data/quick/signatures --over points,recordings
    """
    import pyarrow as pa

    from sigdb.database import open as open_database
    from sigdb.pipeline import fuse_rows

    parts = None if over is None else [name.strip() for name in over.split(",") if name.strip()]
    table, note = fuse_rows(open_database(database), models=models, by=by, where=where, sensors=sensors, over=parts)
    write_rows(pa.Table.from_pandas(table.reset_index(), preserve_index=False).to_reader(), form, sys.stdout.buffer)
    click.echo(note, err=form != "table")
