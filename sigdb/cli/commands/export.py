"""``sigdb export``."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from sigdb.cli.options.limits import limit_options
from sigdb.cli.options.places import DATABASE

if TYPE_CHECKING:
    from sigdb.database import LimitOptions


@click.command()
@click.argument("database", metavar="DB", type=DATABASE)
@click.argument("out", type=click.Path(path_type=Path))
@click.option("--where", help="Only rows that meet this SQL condition, for example 'tooth = 6'.")
@click.option("--signals/--no-signals", default=True, show_default=True, help="Write averages and spectra too.")
@click.option("--sensor", help="Only this sensor's columns, without suffix; by default those of all sensors.")
@limit_options("max_seconds", "max_memory_gb")
def export(
    database: str, out: Path, where: str | None, signals: bool, sensor: str | None, limits: "LimitOptions"
) -> None:
    """Write a database, or some of its rows, for MATLAB: OUT.mat, or OUT.h5 for HDF5.

    Columns without lists are column vectors in the struct (the group) cases. Averages, spectra and Wigner-Ville
    features are matrices, one row a signature, padded with nan where tooth counts differ. Units and descriptions go
    along: structs in a MAT-file, attributes in HDF5. In MATLAB, h5read gives an HDF5 matrix transposed, one column a
    signature. HDF5 is written in batches; a MAT-file is made in memory and holds 2 GB in a variable.

    \b
    Example:
      sigdb export DB tooth6.mat --where "tooth = 6"
    """
    from sigdb.database import open as open_database

    done = open_database(database).export(out, where=where, signals=signals, sensor=sensor, **limits)
    click.echo(f"{done.path}: {done.rows} rows, {done.columns} columns, {done.path.stat().st_size / 1e6:.1f} MB")
