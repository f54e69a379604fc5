"""``sigdb card``."""

import json
from pathlib import Path

import click


@click.command()
@click.argument("database", metavar="DB")
@click.option("--out", type=click.Path(path_type=Path), help="Write to this file instead of the terminal.")
@click.option("--title", help="Title of the page; the database's place if left out.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["markdown", "json"]),
    default="markdown",
    show_default=True,
    help="How the card is written.",
)
def card(database: str, out: Path | None, title: str | None, form: str) -> None:
    """Tell what a finished database is: its size, its cases, how far to trust it, its recipe."""
    from sigdb.database import database_card
    from sigdb.database import open as open_database
    from sigdb.report import database_card_markdown

    facts = database_card(open_database(database))
    said = title or f"Signatures in {database}"
    text = json.dumps(facts, indent=1) + "\n" if form == "json" else database_card_markdown(facts, title=said)
    if out is None:
        click.echo(text, nl=False)
    else:
        out.write_text(text, encoding="utf-8")
        click.echo(f"{out}: written")
