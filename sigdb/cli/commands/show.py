"""``sigdb show``."""

from pathlib import Path

import click

from sigdb.cli.options.places import DATABASE


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("ids", metavar="ID...", type=int, nargs=-1, required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Picture file; by default signature-ID.png. For several rows: folder of these files.",
)
@click.option("--sensor", help="Sensor; by default the first stored one.")
def show(database: str, ids: tuple[int, ...], out: Path | None, sensor: str | None) -> None:
    """Draw signatures of rows: averaged signal, order spectrum, Wigner-Ville distribution.

    The pictures of several rows have the same axes and colours, so that they can be compared.

    \b
    Example:
      sigdb show DB 0 2925 --out pictures
    """
    from sigdb.database import open as open_database
    from sigdb.pipeline import draw_signature

    opened = open_database(database)
    for id in ids:
        file = Path(f"signature-{id}.png")
        path = (out or file) if len(ids) == 1 else (out or Path()) / file
        draw_signature(opened, id, path, sensor=sensor, others=[other for other in ids if other != id])
        click.echo(f"{path}: row {id} of {database}")
