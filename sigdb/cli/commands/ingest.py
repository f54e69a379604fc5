"""``sigdb ingest``."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RECORDING, RIG
from sigdb.cli.options.recordings import options_of_recordings
from sigdb.cli.options.workers import jobs_option, scheduler_option

if TYPE_CHECKING:
    from sigdb.recording import AngleOptions, RecordingOptions


@click.command()
@click.argument("place", metavar="FOLDER|LIST", type=RECORDING)
@click.option("--out", required=True, metavar="DB", help="Directory of the database, or s3://BUCKET/PREFIX.")
@click.option(
    "--table",
    type=RECORDING,
    help="CSV file with a line for each recording and the columns file, machine, date, load, tooth, kind and others; "
    "by default recordings.csv in FOLDER.",
)
@click.option("--pattern", help="Facts in the names of the files, such as '{state}_{load}Nm_{number}.csv'.")
@click.option("--rig", type=RIG, help="Built-in rig or TOML file.")
@click.option(
    "--teeth", metavar="COUNTS", help="Instead of a rig: tooth counts of the gear and its mate, 32/80, or 32."
)
@click.option("--gear", "gears", multiple=True, help="Averaged gear of the rig. Give it several times for several.")
@click.option("--channel", "channels", multiple=True, help="Averaged channel, also several; by default all signals.")
@click.option(
    "--averages",
    type=click.IntRange(1),
    metavar="M",
    help="Revolutions of each average: a recording gives as many averages as it holds, each a row. By default one "
    "average of all revolutions.",
)
@click.option(
    "--averages-of",
    metavar="ARRAY",
    help="The files are of another program and hold averages of one revolution in this array, (rows, n), with labels "
    "in arrays such as tooth, torque or kind: NPZ, MAT, HDF5, Parquet.",
)
@click.option(
    "--samples-per-tooth",
    type=click.IntRange(8),
    default=64,
    show_default=True,
    help="Samples of an average in a tooth pass.",
)
@click.option(
    "--accept",
    multiple=True,
    metavar="CODE",
    help="Doubt of the reading that is accepted, by the code in the status of a row without result.",
)
@options_of_recordings
@jobs_option
@scheduler_option
@format_option("table", "json", of="the summary")
def ingest(
    place: Path,
    out: str,
    table: Path | None,
    pattern: str | None,
    rig: str | None,
    teeth: str | None,
    gears: tuple[str, ...],
    channels: tuple[str, ...],
    averages: int | None,
    averages_of: str | None,
    samples_per_tooth: int,
    accept: tuple[str, ...],
    jobs: int,
    scheduler: str | None,
    form: str,
    reading: "RecordingOptions",
    averaging: "AngleOptions",
) -> None:
    """Make a database of recordings, go on making it, or add new files to it.

    Each average of a gear by a channel becomes a row like those of a sweep, with the file, the machine and the labels
    of the table. A recording that cannot be read becomes a row without result that says why. The recordings stay where
    they are. The command may be stopped at any instant; repeated, it goes on, and takes the files that are new.

    \b
    Example:
      sigdb ingest recordings --out machine.db --teeth 32/80 --tacho tacho
      sigdb ingest simulations --out model.db --teeth 32 --averages-of tsa
    """
    from sigdb.cli.progress import show_progress
    from sigdb.core import plain, validated
    from sigdb.ingest import IngestSettings
    from sigdb.ingest import ingest as ingest_recordings

    stated = {
        "rig": rig,
        "teeth": teeth,
        "gears": gears,
        "channels": channels,
        "averages": averages,
        "averages_of": averages_of,
        "samples_per_tooth": samples_per_tooth,
        "accept": accept,
        "reading": {name: value for name, value in reading.items() if value is not None},
        "averaging": {name: value for name, value in averaging.items() if value not in (None, False)},
    }
    settings = validated(IngestSettings, stated, owner="sigdb ingest")
    started = time.perf_counter()
    with show_progress() as on_progress:
        summary = ingest_recordings(
            place,
            out,
            table=table,
            pattern=pattern,
            settings=settings,
            jobs=jobs,
            scheduler=scheduler,
            on_progress=on_progress,
        )
    if form == "json":
        echo_json(plain(vars(summary)))
        return
    if summary.new_recordings:
        click.echo(f"{out}: ingested {summary.new_recordings} recordings in {time.perf_counter() - started:.1f} s")
    else:
        click.echo(f"{out}: nothing to do, all {summary.recordings} recordings are there")
    click.echo(f"{out}: {summary.rows} rows of {summary.recordings} recordings, {summary.bytes / 1e6:.1f} MB")
    if summary.moved:
        click.echo(f"{summary.moved} recordings have moved, by their SHA-256; their rows are as they were")
    if summary.left_out:
        click.echo(
            f"{len(summary.left_out)} files are left out by the table or the pattern, first {summary.left_out[0]}"
        )
    if summary.failed:
        query = "select status_code, count(*) as rows, min(status) as example from features group by status_code"
        click.echo(f'{summary.failed} rows have no result; their status says why: sigdb query {out} "{query}"')
