"""``sigdb explore``."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.places import RECORDING

if TYPE_CHECKING:
    from sigdb.database import Database


@click.command()
@click.argument("source", metavar="[RIG | DB]", required=False)
@click.argument("row", metavar="[ID]", type=int, required=False)
@click.option("--gear", help="Damaged gear; by default the driving gear of the first mesh.")
@click.option(
    "--recording", "recordings", type=RECORDING, multiple=True, help="Recording that the page offers; several times."
)
@click.option("--view", default="", help="Settings as they stand in the page's address: 'tooth=6&stiffness_loss=0.5'.")
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port of the server; by default a free one.")
@click.option("--browser/--no-browser", default=True, show_default=True, help="Open the page in the browser.")
@click.option("--static", type=click.Path(path_type=Path), help="Write one file that needs no server, and stop.")
def explore(
    source: str | None,
    row: int | None,
    gear: str | None,
    recordings: tuple[Path, ...],
    view: str,
    port: int,
    browser: bool,
    static: Path | None,
) -> None:
    """Open a page on which a signature changes while you move the damage.

    RIG is a built-in rig or a rig file. DB is a database: its rows can be looked through, and its rig is the one whose
    damage moves; a database of recordings has none. The page is served to this machine only.

    \b
    Example:
      sigdb explore nasa-spiral-bevel --view "tooth=6&stiffness_loss=0.5"
    """
    from sigdb.explorer import DEFAULT_RIG, serve_explorer, write_static
    from sigdb.transmission import load_transmission

    database = _database(source) if source is not None else None
    if database is not None and not database.manifest.is_measured:
        from sigdb.database import rig_of

        rig, gear = rig_of(database)
        name = rig.name
    elif database is not None:
        name = DEFAULT_RIG  # a database of recordings holds no rig
        rig = load_transmission(name)
    else:
        if row is not None:
            raise click.UsageError(f"ID is a row of a database, and {source} is none.")
        name = source or DEFAULT_RIG
        rig = load_transmission(name)
    if static is not None:
        write_static(rig, name, static, gear=gear)
        click.echo(f"{static}: {static.stat().st_size / 1e6:.1f} MB")
        return
    serve_explorer(
        rig,
        name,
        gear=gear,
        database=database,
        row=row,
        recordings=recordings,
        view=view,
        port=port,
        browser=browser,
        on_address=lambda address: click.echo(f"{address}\nThe page is open until you press Ctrl+C."),
    )


def _database(source: str) -> "Database | None":
    """Return the database of a place; None if the place is no database but a rig."""
    if "://" not in source and not Path(source).is_dir():
        return None
    from sigdb.database import MANIFEST_FILE
    from sigdb.database import open as open_database

    if "://" in source or (Path(source) / MANIFEST_FILE).is_file():
        return open_database(source)
    return None
