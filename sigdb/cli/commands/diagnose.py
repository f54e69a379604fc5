"""``sigdb diagnose``."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import DATABASE, RECORDING, RECORDING_OR_DATABASE, RIG
from sigdb.cli.options.quantities import Quantity
from sigdb.cli.options.recordings import options_of_channels

if TYPE_CHECKING:
    from sigdb.diagnosis import Diagnosis, JointDiagnosis
    from sigdb.recording import AngleOptions, RecordingOptions


@click.command()
@click.argument("recordings", metavar="RECORDING...", type=RECORDING, nargs=-1, required=True)
@click.option(
    "--healthy",
    type=RECORDING_OR_DATABASE,
    multiple=True,
    help="Healthy recording of the same machine by the same channels. Give it several times: recordings at other loads "
    "and speeds make the limits better. Or a file of --save-reference, or a database of recordings.",
)
@click.option("--where", help="Healthy rows of a database of --healthy, such as \"date < '2026-03-01'\".")
@click.option("--rig", type=RIG, help="Built-in rig or TOML file, with one mesh. Severity needs it.")
@click.option(
    "--teeth",
    metavar="COUNTS",
    help="Instead of a rig: the tooth counts of the averaged gear and its mate, 32/80, or of the averaged gear, 32.",
)
@click.option("--module", help="Module of the pair of --teeth, such as 2mm; by default a usual range.")
@click.option("--model", help="Folder or name of a trained model whose templates are used; needs --rig.")
@click.option(
    "--db",
    "database",
    type=DATABASE,
    help="Database whose templates are used; without --model and --db they are simulated now. Needs --rig.",
)
@click.option("--gear", help="Gear on the averaged shaft; by default the mesh's driving gear.")
@click.option("--sensor", help="The rig's sensor; by default that of the channel's name, or the last one.")
@click.option("--torque", type=Quantity("N m"), help="Torque, N m; by default that of the rig's operating point.")
@click.option(
    "--healthy-torque",
    type=Quantity("N m"),
    multiple=True,
    help="Torque of each --healthy, N m, in their order; by default what the recordings state.",
)
@click.option("--load", type=float, help="Instead of a torque: load in any unit, such as per cent.")
@click.option("--healthy-load", type=float, multiple=True, help="Load of each --healthy, in their order.")
@click.option(
    "--save-reference",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Also write the healthy recordings, or this one if there are none, as a reference: --healthy FILE later.",
)
@options_of_channels
@format_option("table", "json")
@click.option("--out", type=click.Path(path_type=Path), help="Also write a page and its numbers into this folder.")
def diagnose(
    recordings: tuple[Path, ...],
    healthy: tuple[Path, ...],
    where: str | None,
    rig: str | None,
    teeth: str | None,
    module: str | None,
    model: str | None,
    database: str | None,
    gear: str | None,
    sensor: str | None,
    torque: float | None,
    healthy_torque: tuple[float, ...],
    load: float | None,
    healthy_load: tuple[float, ...],
    save_reference: Path | None,
    channels: tuple[str, ...],
    form: str,
    out: Path | None,
    reading: "RecordingOptions",
    averaging: "AngleOptions",
) -> int:
    """Diagnose a recording: whether a tooth stands out, which, how severely, and what would have been seen.

    Several recordings of the machine in one state, several channels, and several speeds and loads have one answer.

    The exit code is 0 if no tooth stands out, 1 if one does, 2 for bad input, and 3 if it cannot be judged.

    \b
    Example:
      sigdb diagnose run.csv --healthy new.csv --teeth 32/80 --tacho tacho --out diagnosis
    """
    from sigdb.database import is_database
    from sigdb.diagnosis import diagnose as diagnose_recording
    from sigdb.diagnosis import diagnose_jointly, is_reference
    from sigdb.ingest import database_defaults
    from sigdb.recording import read_of_any_size

    if save_reference is not None and len(channels) > 1:
        raise click.UsageError("A reference is of one channel: give --channel once with --save-reference.")
    stated = {name: value for name, value in reading.items() if value is not None}
    database_reading = next((database_defaults(each).reading for each in healthy if is_database(each)), {})
    reading = cast("RecordingOptions", database_reading | stated)
    read = [each if is_reference(each) else read_of_any_size(each, **reading) for each in recordings]
    facts: dict[str, Any] = {
        "rig": rig,
        "healthy": [
            each if is_database(each) or is_reference(each) else read_of_any_size(each, **reading) for each in healthy
        ],
        "where": where,
        "teeth": teeth,
        "module": module,
        "model": model,
        "database": database,
        "gear": gear,
        "sensor": sensor,
        "torque": torque,
        "healthy_torque": healthy_torque,
        "load": load,
        "healthy_load": healthy_load,
        **averaging,
    }
    if save_reference is None and max(len(read), len(channels)) > 1:
        joint = diagnose_jointly(read, of_channels=channels, **facts)
        if len(joint.parts) > 1:
            return _show_joint(joint, form, out)
        diagnosis = joint.parts[0].diagnosis
    else:
        facts |= {"channel": channels[0]} if channels else {}
        diagnosis = diagnose_recording(read, save_reference=save_reference, **facts)
    return _show(diagnosis, form, out)


def _show(diagnosis: "Diagnosis", form: str, out: Path | None) -> int:
    from sigdb.report import Terminal, diagnosis_text, write_diagnosis_report

    if form == "json":
        echo_json(diagnosis.as_json(), indent=None)
    else:
        click.echo(diagnosis_text(diagnosis, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        click.echo(f"page: {write_diagnosis_report(diagnosis, out, command=_command())}", err=True)
    return diagnosis.exit_code


def _show_joint(joint: "JointDiagnosis", form: str, out: Path | None) -> int:
    from sigdb.report import Terminal, joint_diagnosis_text, write_joint_report

    if form == "json":
        echo_json(joint.as_json(), indent=None)
    else:
        click.echo(joint_diagnosis_text(joint, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        click.echo(f"page: {write_joint_report(joint, out, command=_command())}", err=True)
    return joint.exit_code


def _command() -> str:
    return shlex.join(["sigdb", *sys.argv[1:]])
