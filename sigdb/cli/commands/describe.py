"""``sigdb describe``."""

import sys
from pathlib import Path

import click

from sigdb.cli.options.format import echo_json, format_option


@click.command()
@click.argument("rig")
@click.option("--out", type=click.Path(path_type=Path), help="Also draw rig.png and campbell.png into this folder.")
@format_option("text", "json")
def describe(rig: str, out: Path | None, form: str) -> None:
    """Describe a rig: parts, forces on the teeth, frequencies, resonances, origins of the numbers.

    RIG is the name of a built-in rig or a TOML file.
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

        for path in draw_rig(loaded, out):
            click.echo(f"drawn: {path}", err=True)
