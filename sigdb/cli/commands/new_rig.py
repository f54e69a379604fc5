"""``sigdb new-rig``."""

from pathlib import Path

import click


@click.command("new-rig")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Overwrite the file if it exists.")
def new_rig(file: Path, force: bool) -> None:
    """Write a rig file to start from: a spur pair, every field with its unit and meaning.

    FILE ends in .toml. The rig can be loaded and simulated as it is; replace its numbers and their sources.
    """
    from sigdb.transmission import write_new_rig

    path = write_new_rig(file, overwrite=force)
    click.echo(f"{path}: a spur pair to start from; look at it with: sigdb describe {path}")
