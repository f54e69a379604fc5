"""``sigdb new-rig``."""

from pathlib import Path

import click

from sigdb.cli.options.quantities import Quantity
from sigdb.core import separate_quantities


def _modules(ctx: click.Context, param: click.Parameter, texts: tuple[str, ...]) -> list[float]:
    """Return the modules of all uses of an option, in m."""
    module = Quantity("m", min=0, min_open=True)
    return [module.convert(text, param, ctx) for listed in texts for text in separate_quantities(listed)]


@click.command("new-rig")
@click.argument("file", type=click.Path(path_type=Path), required=False)
@click.option(
    "--teeth",
    "--stages",
    metavar="Z1/Z2",
    multiple=True,
    help="Tooth counts of driving and driven gear, as 23/67; once for each stage, or 23/67,19/81.",
)
@click.option("--speed", type=Quantity("rpm", min=0, min_open=True), help="Speed of the driving shaft, rpm.")
@click.option("--torque", type=Quantity("N m", min=0, min_open=True), help="Torque on the driving shaft, N m.")
@click.option(
    "--module",
    metavar="QUANTITY",
    multiple=True,
    callback=_modules,
    help="Normal module, m: of all stages, or of each, as 2.5mm,3mm; sized by the torque if left out.",
)
@click.option("--helix-angle", type=Quantity("deg", min=0), help="Helix angle of all stages, deg; spur if left out.")
@click.option("--force", is_flag=True, help="Overwrite the file if it exists.")
@click.option(
    "--energy-method",
    is_flag=True,
    help="Take the mesh stiffness from the shape of the teeth; needed for cracks, pits, wear and chips by their size.",
)
def new_rig(
    file: Path | None,
    teeth: tuple[str, ...],
    speed: float | None,
    torque: float | None,
    module: list[float],
    helix_angle: float | None,
    force: bool,
    energy_method: bool,
) -> None:
    """Write a rig file from what is known of a rig, or a spur pair to start from.

    With --teeth, --speed and --torque all other numbers are of the right size for that rig, by rules of machine
    design, each with its source and its range. Without them the file holds a spur pair whose numbers are to be
    replaced. Every field has its unit and meaning.

    FILE ends in .toml. Without it the rig of known numbers is printed.

    \b
    Example:
      sigdb new-rig --teeth 23/67 --module 2.5mm --speed 1480rpm --torque 45Nm my_rig.toml
      sigdb new-rig my_pair.toml
    """
    from sigdb.core import validated
    from sigdb.transmission import KnownNumbers, new_rig_text, write_new_rig

    options = {"--teeth": teeth, "--speed": speed, "--torque": torque, "--module": module, "--helix-angle": helix_angle}
    stated = [name for name, value in options.items() if value not in (None, (), [])]
    numbers = None
    if stated:
        lacking = [name for name in ("--teeth", "--speed", "--torque") if name not in stated]
        if lacking:
            raise click.UsageError(f"{stated[0]} needs {' and '.join(lacking)} too.")
        values = {"teeth": teeth, "speed_rpm": speed, "torque": torque, "module": module or None}
        numbers = validated(KnownNumbers, values | {"helix_angle_deg": helix_angle or 0.0}, owner="new-rig")
    if file is not None:
        path = write_new_rig(file, overwrite=force, energy_method=energy_method, numbers=numbers)
        kind = "a spur pair to start from" if numbers is None else "a rig from the known numbers"
        click.echo(f"{path}: {kind}; look at it with: sigdb describe {path}")
    elif numbers is None:
        raise click.UsageError("Missing argument 'FILE'; or give --teeth, --speed and --torque.")
    else:
        click.echo(new_rig_text("new-rig", energy_method=energy_method, numbers=numbers), nl=False)
