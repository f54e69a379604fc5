"""``sigdb describe``."""

import sys
from pathlib import Path

import click

from sigdb.cli.options.format import echo_json, format_option
from sigdb.cli.options.places import RIG
from sigdb.cli.options.quantities import Quantity


@click.command()
@click.argument("rig", type=RIG)
@click.option("--out", type=click.Path(path_type=Path), help="Also draw rig.png and campbell.png into this folder.")
@click.option(
    "--max-hz",
    type=Quantity("Hz", min=0, min_open=True),
    help="Highest frequency in campbell.png; by default beyond the third harmonic of the fastest mesh.",
)
@format_option("text", "json")
def describe(rig: str, out: Path | None, max_hz: float | None, form: str) -> None:
    """Describe a rig: parts, forces on the teeth, frequencies, resonances, origins of the numbers.

    RIG is the name of a built-in rig or a TOML file.

    \b
    Example:
      sigdb describe nasa-spiral-bevel --out rig
    """
    from sigdb.report import Terminal, rig_text
    from sigdb.transmission import describe_rig, load_transmission

    loaded = load_transmission(rig)
    summary = describe_rig(loaded)
    if form == "json":
        echo_json(summary)
    else:
        click.echo(rig_text(summary, terminal=Terminal.of(sys.stdout)), nl=False)
    if out is not None:
        from sigdb.pipeline import draw_rig  # matplotlib starts slowly

        for path in draw_rig(loaded, out, max_hz=max_hz):
            click.echo(f"drawn: {path}", err=True)
