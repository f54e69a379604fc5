"""``sigdb signature``."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RECORDING, RIG
from sigdb.cli.options.recordings import recording_options

if TYPE_CHECKING:
    from sigdb.recording import AngleOptions, RecordingOptions

_LARGE = ("record_spectrum", "envelope_spectrum")
"""Tens of thousands of numbers, which a report holds and the terminal does not show."""


@click.command()
@click.argument("recordings", metavar="RECORDING...", nargs=-1, required=True, type=RECORDING)
@click.option("--teeth", type=click.IntRange(1), help="Tooth count of the gear on the averaged shaft.")
@click.option("--rig", type=RIG, help="Built-in rig or TOML file; it gives orders, sidebands and tooth cycle.")
@click.option(
    "--gear", help="The rig's gear on the averaged shaft; by default the driving gear of a rig with one mesh."
)
@recording_options
@click.option(
    "--samples-per-tooth",
    type=click.IntRange(8),
    default=64,
    show_default=True,
    help="Samples of the average per tooth pass.",
)
@click.option(
    "--baseline",
    type=click.IntRange(1),
    help="Number of healthy recordings at the beginning of a history; adds NA4* and NB4*.",
)
@click.option(
    "--in-blocks", is_flag=True, help="Read the recordings in blocks, as those that are too large are in any case."
)
@format_option("table", "json")
@click.option("--out", type=click.Path(path_type=Path), help="Also write a page and its numbers into this folder.")
def signature(
    recordings: tuple[Path, ...],
    teeth: int | None,
    rig: str | None,
    gear: str | None,
    samples_per_tooth: int,
    baseline: int | None,
    in_blocks: bool,
    form: str,
    out: Path | None,
    reading: "RecordingOptions",
    averaging: "AngleOptions",
) -> None:
    """Compute the signatures of recordings: speed, synchronous average, spectrum, indicators.

    Several recordings are a history of one machine, oldest first: NA4 and NB4 compare them.

    \b
    Example:
      sigdb signature run.csv --sampling-rate 12800 --teeth 32 --mesh-phase --out signature
    """
    from sigdb.recording import AveragingSettings, read_of_any_size, recorded_history, recorded_signature
    from sigdb.report import Terminal, history_text, overview_text, recorded_text, write_recorded_report
    from sigdb.transmission import load_transmission

    if baseline is not None and len(recordings) < 2:
        raise click.UsageError("--baseline compares recordings; give several.")
    settings = AveragingSettings(teeth=teeth, gear=gear, samples_per_tooth=samples_per_tooth, **averaging)
    files = [read_of_any_size(path, in_blocks=in_blocks, **reading) for path in recordings]
    if form == "table":
        terminal = Terminal.of(sys.stdout)
        click.echo("\n".join(overview_text(recording, terminal=terminal) for recording in files))
    loaded = None if rig is None else load_transmission(rig)
    signatures = [recorded_signature(recording, settings, rig=loaded) for recording in files]
    history = recorded_history(signatures, baseline=baseline) if len(signatures) > 1 else None
    if form == "json":
        facts = [signature.as_json() for signature in signatures]
        echo_json([{name: fact[name] for name in fact if name not in _LARGE} for fact in facts], indent=None)
    else:
        texts = [recorded_text(signature, terminal=terminal) for signature in signatures]
        texts += [] if history is None else [history_text(history, terminal=terminal)]
        click.echo("\n".join(texts), nl=False)
    if out is not None:
        page = write_recorded_report(signatures, out, history=history, title=f"Signature of {recordings[0].name}")
        click.echo(f"page: {page}", err=True)
