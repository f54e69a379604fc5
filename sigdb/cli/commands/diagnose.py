"""``sigdb diagnose``."""

import json
from pathlib import Path
from typing import Any

import click

from sigdb.cli.options.recordings import read, recording_options


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
    form: str,
    out: Path | None,
    **options: Any,
) -> None:
    """From a recording to an answer: damaged or not, which tooth, how severe, or why it cannot be told.

    Example: sigdb diagnose run.csv --rig rig.toml --healthy new.csv --tacho tacho --out diagnosis
    """
    from sigdb.diagnosis import diagnose as diagnosed
    from sigdb.pipeline import write_diagnosis
    from sigdb.report import diagnosis_text

    one, *others = read((recording, *([healthy] if healthy else [])), options)
    found = diagnosed(one, rig, healthy=others[0] if others else None, **options)
    click.echo(json.dumps(found.as_json()) if form == "json" else diagnosis_text(found.as_json()), nl=form == "json")
    if out is not None:
        click.echo(f"page: {write_diagnosis(found, out)}", err=True)
