"""``sigdb diagnose``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE, RECORDING, RIG
from sigdb.cli.options.quantities import Quantity
from sigdb.cli.options.recordings import recording_options

if TYPE_CHECKING:
    from sigdb.recording import AngleOptions, RecordingOptions


@click.command()
@click.argument("recording", type=RECORDING)
@click.option("--rig", type=RIG, required=True, help="Built-in rig or TOML file, with one mesh.")
@click.option(
    "--healthy",
    type=RECORDING,
    help="Healthy recording of the same rig by the same channel; it shows the path from mesh to sensor.",
)
@click.option("--model", help="Folder or name of a trained model whose templates are used.")
@click.option(
    "--db",
    "database",
    type=DATABASE,
    help="Database whose templates are used; without --model and --db they are simulated now.",
)
@click.option("--gear", help="Gear on the averaged shaft; by default the mesh's driving gear.")
@click.option("--sensor", help="The rig's sensor; by default that of the channel's name, or the first one.")
@click.option("--torque", type=Quantity("N m"), help="Torque, N m; by default that of the rig's operating point.")
@recording_options
@format_option("table", "json")
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
    """Diagnose a recording: damage or none, the tooth, the severity, or why there is no answer.

    \b
    Example:
      sigdb diagnose run.csv --rig rig.toml --healthy new.csv --tacho tacho --out diagnosis
    """
    from sigdb.diagnosis import diagnose as diagnose_recording
    from sigdb.recording import read_of_any_size
    from sigdb.report import Terminal, diagnosis_text, write_diagnosis_report

    diagnosis = diagnose_recording(
        read_of_any_size(recording, **reading),
        rig,
        healthy=None if healthy is None else read_of_any_size(healthy, **reading),
        model=model,
        database=database,
        gear=gear,
        sensor=sensor,
        torque=torque,
        **averaging,
    )
    if form == "json":
        echo_json(diagnosis.as_json(), indent=None)
    else:
        click.echo(diagnosis_text(diagnosis, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        click.echo(f"page: {write_diagnosis_report(diagnosis, out)}", err=True)
