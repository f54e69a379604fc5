"""``sigdb signature``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sigdb.cli.options.recordings import read, recording_options

if TYPE_CHECKING:
    import pandas as pd

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
    rig: str | None,
    baseline: int | None,
    form: str,
    out: Path | None,
    **options: Any,
) -> None:
    """From recordings to signatures: speed, synchronous average, spectrum, indicators.

    Several recordings are a history of one machine, oldest first: NA4 and NB4 compare them.

    Example: sigdb signature run.csv --sampling-rate 12800 --teeth 32 --mesh-phase --out signature
    """
    from sigdb.recording import recorded_history, recorded_signature
    from sigdb.report import history_text, recorded_text, write_recorded_report
    from sigdb.transmission import load_transmission

    if baseline is not None and len(recordings) < 2:
        raise click.UsageError("--baseline compares recordings; give several.")
    read_ones = read(recordings, options)
    loaded = None if rig is None else load_transmission(rig)
    signatures = [recorded_signature(one, rig=loaded, **options) for one in read_ones]
    facts = [one.as_json() for one in signatures]
    history = _rows(recorded_history(signatures, baseline=baseline)) if len(facts) > 1 else []
    if form == "json":
        click.echo(json.dumps([{name: fact for name, fact in one.items() if name != _LARGE} for one in facts]))
    else:
        click.echo("\n".join([*map(recorded_text, facts), *([history_text(history)] if history else [])]), nl=False)
    if out is not None:
        page = write_recorded_report(facts, out, history=history, title=f"Signature of {recordings[0].name}")
        click.echo(f"page: {page}", err=True)


def _rows(table: "pd.DataFrame") -> list[dict[str, Any]]:
    """Rows as dictionaries, with None for a number that is not known."""
    known = table.astype(object).where(table.notna(), None)
    return [{str(name): value for name, value in row.items()} for row in known.to_dict("records")]
