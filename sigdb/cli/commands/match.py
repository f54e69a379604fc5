"""``sigdb match``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import format_option
from sigdb.cli.options.limits import limit_options
from sigdb.cli.options.places import DATABASE
from sigdb.cli.rows import write_rows
from sigdb.core import InputError

if TYPE_CHECKING:
    from sigdb.core import FloatArray
    from sigdb.database import LimitOptions


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("recording", type=click.Path(path_type=Path), required=False)
@click.option("--id", type=int, help="Compare this row of the database instead of a recording.")
@click.option("--of", "other", type=DATABASE, metavar="OTHER", help="The row of --id is of this database.")
@click.option("--k", type=click.IntRange(1), default=10, show_default=True, help="Number of templates to show.")
@click.option("--sensor", help="Sensor; by default the first stored one.")
@click.option("--where", help="Only templates that meet this SQL condition, for example 'torque > 100'.")
@click.option("--whole-teeth", is_flag=True, help="Turn by whole teeth only: sample 0 is at the tacho mark.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="In place of a match, draw where the healthy rows of --of, a database of recordings, lie among those of DB; "
    "--where selects others.",
)
@format_option("table", "csv", "json", of="the rows")
@limit_options("max_seconds", "max_memory_gb")
def match(
    database: str,
    recording: Path | None,
    id: int | None,
    other: str | None,
    k: int,
    sensor: str | None,
    where: str | None,
    whole_teeth: bool,
    out: Path | None,
    form: str,
    limits: "LimitOptions",
) -> None:
    """Find the templates nearest to a measured average of one revolution, over all turns.

    In a database of recordings the nearest rows are found instead. So the row of one database is compared with the
    templates or the rows of another: `--of OTHER --id ID`.

    RECORDING is a file of one revolution: text with one number a line, or a NumPy array (.npy). It has as many samples
    a tooth as the database. The residual_distance is the root mean square of the difference of residuals, in standard
    deviations of the average. The match is the normalised overlap of the residuals, 0 for the healthy template. The
    turn is in teeth. The table leaves out the notes and the SHA-256 of recordings; csv and json have them.

    A raw recording goes to `sigdb diagnose RECORDING --rig RIG --db DB`, which averages it first.

    \b
    Example:
      sigdb match DB average.txt
    """
    import numpy as np
    import pyarrow as pa

    from sigdb.database import open as open_database

    if out is not None:
        if other is None:
            raise click.UsageError("Give the database of recordings by --of.")
        from sigdb.pipeline import draw_among

        click.echo(draw_among(open_database(database), open_database(other), out, where=where))
        return
    if (recording is None) == (id is None):
        raise click.UsageError("Give either RECORDING or --id.")
    if other is not None and id is None:
        raise click.UsageError("Give the row of --of by --id.")
    opened = open_database(database)
    rows, of = (opened, sensor) if other is None else (open_database(other), None)
    tsa = _revolution(recording) if recording is not None else rows.signals(np.array([id]), sensor=of)["tsa"][0]
    step = opened.manifest.resolved["signature"]["samples_per_tooth"]
    turns = range(len(tsa) // step) if whole_teeth else None
    nearest = opened.match(tsa, k=k, sensor=sensor, where=where, turns=turns, **limits)
    long = ["sha256", "notes"] if form == "table" else []
    table = nearest.table.drop(columns=long, errors="ignore")
    write_rows(pa.Table.from_pandas(table, preserve_index=False).to_reader(), form, sys.stdout.buffer)
    click.echo(nearest.verdict, err=form != "table")


def _revolution(path: Path) -> "FloatArray":
    """One revolution from a file of numbers, a row or a column."""
    import warnings

    import numpy as np

    if not path.is_file():
        raise InputError(f"{path}: no such file; give a file of one revolution, or a row of the database by --id")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of a file without numbers
            x = np.load(path, allow_pickle=False) if path.suffix == ".npy" else np.loadtxt(path, delimiter=",", ndmin=1)
        return np.asarray(x, dtype=float).squeeze()
    except (ValueError, TypeError, EOFError, UserWarning) as error:
        raise InputError(
            f"{path}: not one revolution, one number a line or a .npy array ({error}); a raw recording goes to "
            "sigdb diagnose"
        ) from None
