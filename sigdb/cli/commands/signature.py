"""``sigdb signature``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.recordings import recording_options

if TYPE_CHECKING:
    from sigdb.recording import AngleOptions, RecordingOptions

_LARGE = "record_spectrum"
"""What is not printed: tens of thousands of numbers, which a report has."""


@click.command()
@click.argument("recordings", metavar="RECORDING...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--teeth", type=click.IntRange(1), help="Tooth count of the gear on the averaged shaft.")
@click.option("--rig", help="Built-in rig or TOML file: names orders and sidebands, tells the tooth cycle.")
@click.option("--gear", help="The rig's gear on the averaged shaft.")
@recording_options
@click.option(
    "--samples-per-tooth",
    type=click.IntRange(8),
    default=64,
    show_default=True,
    help="Samples of the average in a tooth pass.",
)
@click.option("--baseline", type=click.IntRange(1), help="First, healthy recordings of a history: adds NA4* and NB4*.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "json"]),
    default="table",
    show_default=True,
    help="How the facts are written.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Also write a page and its numbers into this folder.")
def signature(
    recordings: tuple[Path, ...],
    teeth: int | None,
    rig: str | None,
    gear: str | None,
    samples_per_tooth: int,
    baseline: int | None,
    form: str,
    out: Path | None,
    reading: "RecordingOptions",
    averaging: "AngleOptions",
) -> None:
    """From recordings to signatures: speed, synchronous average, spectrum, indicators.

    Several recordings are a history of one machine, oldest first: NA4 and NB4 compare them.

    Example: sigdb signature run.csv --sampling-rate 12800 --teeth 32 --mesh-phase --out signature
    """
    from sigdb.recording import AveragingSettings, read_recording, recorded_history, recorded_signature
    from sigdb.report import history_text, recorded_text, write_recorded_report
    from sigdb.transmission import load_transmission

    if baseline is not None and len(recordings) < 2:
        raise click.UsageError("--baseline compares recordings; give several.")
    settings = AveragingSettings(teeth=teeth, gear=gear, samples_per_tooth=samples_per_tooth, **averaging)
    files = [read_recording(path, **reading) for path in recordings]
    loaded = None if rig is None else load_transmission(rig)
    signatures = [recorded_signature(recording, settings, rig=loaded) for recording in files]
    history = recorded_history(signatures, baseline=baseline) if len(signatures) > 1 else None
    if form == "json":
        facts = [signature.as_json() for signature in signatures]
        click.echo(
            json.dumps([{name: value for name, value in signature.items() if name != _LARGE} for signature in facts])
        )
    else:
        texts = [recorded_text(signature) for signature in signatures]
        click.echo("\n".join(texts if history is None else [*texts, history_text(history)]), nl=False)
    if out is not None:
        page = write_recorded_report(signatures, out, history=history, title=f"Signature of {recordings[0].name}")
        click.echo(f"page: {page}", err=True)
