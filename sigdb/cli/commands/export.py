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
@click.argument("out", type=click.Path(path_type=Path), required=False)
@click.option("--where", help="Only rows that meet this SQL condition, for example 'tooth = 6'.")
@click.option("--signals/--no-signals", default=True, show_default=True, help="Write averages and spectra too.")
@click.option("--sensor", help="Only this sensor's columns, without suffix; by default those of all sensors.")
@click.option("--delta", is_flag=True, help="Register the Parquet files of DB as Delta tables, instead of writing OUT.")
@click.option(
    "--iceberg",
    metavar="CATALOG",
    help="Register the Parquet files of DB in this Iceberg catalog, instead of writing OUT: a name in pyiceberg's "
    "configuration, or a SQLite file CATALOG.db.",
)
@click.option("--namespace", help="Namespace in the catalog; by default the name of the folder DB.")
@limit_options("max_seconds", "max_memory_gb")
def export(
    database: str,
    out: Path | None,
    where: str | None,
    signals: bool,
    sensor: str | None,
    delta: bool,
    iceberg: str | None,
    namespace: str | None,
    limits: "LimitOptions",
) -> None:
    """Write a database, or some of its rows, for MATLAB: OUT.mat, or OUT.h5 for HDF5. Or register its tables.

    Columns without lists are column vectors in the struct (the group) cases. Averages, spectra and Wigner-Ville
    features are matrices, one row a signature, padded with nan where tooth counts differ. Units and descriptions go
    along: structs in a MAT-file, attributes in HDF5. In MATLAB, h5read gives an HDF5 matrix transposed, one column a
    signature. HDF5 is written in batches; a MAT-file is made in memory and holds 2 GB in a variable.

    With --delta or --iceberg no file is written again: the Parquet files of DB become tables that readers of Delta
    Lake or Apache Iceberg open. Repeat the command when DB has new rows, and for Iceberg after DB was moved; sigdb
    verify says when.

    \b
    Example:
      sigdb export DB tooth6.mat --where "tooth = 6"
      sigdb export DB --delta
      sigdb export DB --iceberg catalog.db
    """
    from sigdb.core import InputError
    from sigdb.database import open as open_database

    if namespace is not None and iceberg is None:
        raise InputError("--namespace is of a catalog; give --iceberg CATALOG too")
    if not (delta or iceberg):
        if out is None:
            raise InputError("OUT is missing: a file OUT.mat or OUT.h5; or give --delta or --iceberg CATALOG")
        done = open_database(database).export(out, where=where, signals=signals, sensor=sensor, **limits)
        click.echo(f"{done.path}: {done.rows} rows, {done.columns} columns, {done.path.stat().st_size / 1e6:.1f} MB")
        return
    if out is not None or where is not None or sensor is not None or not signals:
        raise InputError("--delta and --iceberg register all of DB; leave out OUT, --where, --no-signals and --sensor")
    opened = open_database(database)
    for table in (
        *(opened.register_delta() if delta else ()),
        *(opened.register_iceberg(iceberg, namespace=namespace) if iceberg else ()),
    ):
        click.echo(str(table))
