"""``sigdb describe``."""

import json
from pathlib import Path

import click


@click.command()
@click.argument("rig")
@click.option("--out", type=click.Path(path_type=Path), help="Also draw rig.png and campbell.png into this folder.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="How the page is written.",
)
def describe(rig: str, out: Path | None, form: str) -> None:
    """Describe a rig: parts, forces on the teeth, frequencies, resonances, origins of the numbers.

    RIG is the name of a built-in rig or a TOML file.
    """
    from sigdb.pipeline import draw_rig
    from sigdb.report import rig_text
    from sigdb.transmission import describe_rig, load_transmission

    loaded = load_transmission(rig)
    facts = describe_rig(loaded)
    click.echo(json.dumps(facts, indent=1) if form == "json" else rig_text(facts), nl=form == "json")
    for path in draw_rig(loaded, out) if out is not None else ():
        click.echo(f"drawn: {path}", err=True)
