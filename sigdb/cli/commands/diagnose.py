"""``sigdb diagnose``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.recordings import recording_options

if TYPE_CHECKING:
    from sigdb.recording import AngleOptions, RecordingOptions


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--rig", required=True, help="Built-in rig or TOML file, with one mesh.")
@click.option(
    "--healthy",
    type=click.Path(path_type=Path),
    help="Healthy recording of the same rig by the same channel: tells the path from mesh to sensor.",
)
@click.option("--model", help="Folder or name of a trained model whose templates are used.")
@click.option("--db", "database", help="Database whose templates are used; simulated now if neither is given.")
@click.option("--gear", help="Gear on the averaged shaft; the mesh's driving gear if left out.")
@click.option("--sensor", help="The rig's sensor; that of the channel's name, or the first one, if left out.")
@click.option("--torque", type=float, help="Torque in N m, as the rig's operating point has it, if another one.")
@recording_options
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the answer is written.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Also write a page and its numbers into this folder.")
def diagnose(
    recording: Path,
    rig: str,
    healthy: Path | None,
    model: str | None,
    database: str | None,
    gear: str | None,
    sensor: str | None,
    torque: float | None,
    form: str,
    out: Path | None,
    reading: "RecordingOptions",
    averaging: "AngleOptions",
) -> None:
    """From a recording to an answer: damaged or not, which tooth, how severe, or why it cannot be told.

    Example: sigdb diagnose run.csv --rig rig.toml --healthy new.csv --tacho tacho --out diagnosis
    """
    from sigdb.diagnosis import diagnose as diagnose_recording
    from sigdb.recording import read_recording
    from sigdb.report import diagnosis_text, write_diagnosis_report

    diagnosis = diagnose_recording(
        read_recording(recording, **reading),
        rig,
        healthy=None if healthy is None else read_recording(healthy, **reading),
        model=model,
        database=database,
        gear=gear,
        sensor=sensor,
        torque=torque,
        **averaging,
    )
    click.echo(json.dumps(diagnosis.as_json()) if form == "json" else diagnosis_text(diagnosis), nl=form == "json")
    if out is not None:
        click.echo(f"page: {write_diagnosis_report(diagnosis, out)}", err=True)
