"""``sigdb show``."""

from pathlib import Path

import click


@click.command()
@click.argument("database", metavar="DB")
@click.argument("id", type=int)
@click.option("--out", type=click.Path(path_type=Path), help="Picture file; by default signature-ID.png.")
@click.option("--sensor", help="Sensor; by default the first stored one.")
def show(database: str, id: int, out: Path | None, sensor: str | None) -> None:
    """Draw a row's signature: averaged signal, order spectrum, Wigner-Ville distribution."""
    from sigdb.database import open as open_database
    from sigdb.pipeline import draw_signature

    path = draw_signature(open_database(database), id, out or Path(f"signature-{id}.png"), sensor=sensor)
    click.echo(f"{path}: row {id} of {database}")
