"""``sigdb card``."""

from pathlib import Path

import click

from sigdb.cli.options.format import format_option
from sigdb.cli.options.places import DATABASE


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.option("--out", type=click.Path(path_type=Path), help="Write to this file instead of the terminal.")
@click.option("--title", help="Title of the page; by default the place of the database.")
@format_option("markdown", "json", of="the card")
def card(database: str, out: Path | None, title: str | None, form: str) -> None:
    """Describe a finished database: its size, its cases, how far to trust it, its recipe.

    The card of a database of recordings has machines, gears, sensors, dates and labels.

    \b
    Example:
      sigdb card data/quick/signatures --out card.md
    """
    from sigdb.core import json_text, publish
    from sigdb.database import database_card, recordings_card
    from sigdb.database import open as open_database
    from sigdb.report import database_card_markdown, recordings_card_markdown

    opened, heading = open_database(database), title or f"Signatures in {database}"
    if opened.manifest.is_measured:
        recorded = recordings_card(opened)
        text = json_text(recorded) if form == "json" else recordings_card_markdown(recorded, title=heading)
    else:
        facts = database_card(opened)
        text = json_text(facts) if form == "json" else database_card_markdown(facts, title=heading)
    if out is None:
        click.echo(text, nl=False)
    else:
        publish(out, text)
        click.echo(f"{out}: written")
