"""``sigdb new-rig``."""

from pathlib import Path

import click


@click.command("new-rig")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Overwrite the file if it exists.")
@click.option(
    "--energy-method",
    is_flag=True,
    help="Take the mesh stiffness from the shape of the teeth; needed for cracks, pits, wear and chips by their size.",
)
def new_rig(file: Path, force: bool, energy_method: bool) -> None:
    """Write a rig file to start from: a spur pair, every field with its unit and meaning.

    FILE ends in .toml. The rig can be loaded and simulated as it is; replace its numbers and their sources.

    \b
    Example:
      sigdb new-rig my_rig.toml
    """
    from sigdb.transmission import write_new_rig

    path = write_new_rig(file, overwrite=force, energy_method=energy_method)
    click.echo(f"{path}: a spur pair to start from; look at it with: sigdb describe {path}")
