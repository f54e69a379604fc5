"""``sigdb diagnose``."""

import json
from pathlib import Path
from typing import Any

import click

_READING = ("tacho", "sampling_rate", "pulses_per_rev", "ratio", "variable", "unit")


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
@click.option("--channel", help="Recorded signal; the first one if left out.")
@click.option("--tacho", metavar="CHANNEL", help="Channel with the tacho.")
@click.option("--mesh-phase", is_flag=True, help="Take the angle from the phase of the mesh: no tacho is needed.")
@click.option("--torque", type=float, help="Torque in N m, as the rig's operating point has it, if another one.")
@click.option("--speed-rpm", type=click.FloatRange(0, min_open=True), help="Speed for --mesh-phase, to within 5 %.")
@click.option("--sampling-rate", type=click.FloatRange(0, min_open=True), help="Hz, where the file does not say it.")
@click.option("--pulses-per-rev", type=click.IntRange(1), help="Pulses of the tacho a revolution of its shaft.")
@click.option(
    "--ratio", type=click.FloatRange(0, min_open=True), help="Revolutions of the averaged shaft in one of the tacho's."
)
@click.option("--variable", help="Array or group of a file that holds several.")
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
    form: str,
    out: Path | None,
    **options: Any,
) -> None:
    """From a recording to an answer: damaged or not, which tooth, how severe, or why it cannot be told.

    Example: sigdb diagnose run.csv --rig rig.toml --healthy new.csv --tacho tacho --out diagnosis
    """
    from sigdb.measurement import read_recording
    from sigdb.pipeline import diagnose as diagnosed
    from sigdb.pipeline import write_diagnosis
    from sigdb.report import diagnosis_text

    if options["tacho"] is not None and options["mesh_phase"]:
        raise click.UsageError("Give either --tacho or --mesh-phase.")
    reading = {name: options.pop(name) for name in _READING if name in options}
    given = {name: value for name, value in reading.items() if value is not None}
    found = diagnosed(
        read_recording(recording, **given),
        rig,
        healthy=None if healthy is None else read_recording(healthy, **given),
        **options,
    )
    click.echo(json.dumps(found.as_json()) if form == "json" else diagnosis_text(found.as_json()), nl=form == "json")
    if out is not None:
        click.echo(f"page: {write_diagnosis(found, out)}", err=True)
