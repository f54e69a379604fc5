"""Export of a database, or of a part of it, to files that MATLAB reads."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from sigdb.core import InputError
from sigdb.database.export.columns import ExportColumn, export_batches, export_columns
from sigdb.database.export.hdf5 import write_hdf5
from sigdb.database.export.mat import check_size, write_mat
from sigdb.database.store.store import publish
from sigdb.signature import FEATURES

if TYPE_CHECKING:
    from sigdb.database.database import Database

_WRITERS = {".mat": write_mat, ".h5": write_hdf5, ".hdf5": write_hdf5}
_BATCH = 2048


@dataclass(frozen=True, kw_only=True)
class Export:
    """What was written: the file, its rows and its columns."""

    path: Path
    rows: int
    columns: int


def export_database(
    database: "Database", path: str | Path, *, where: str | None, signals: bool, sensor: str | None
) -> Export:
    """What :meth:`Database.export` does."""
    path = Path(path)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        raise InputError(f"{path}: the name of an export ends in .mat or .h5, which says what is written")
    columns = export_columns(database, signals=signals, sensor=sensor)
    if write is write_mat:
        check_size(_list_sizes(database, where, columns))
    counted: list[int] = []
    batches = export_batches(database, where, columns, _BATCH)
    about = _about(database, where)
    publish(path, lambda temporary: counted.append(write(temporary, columns, batches, about)))
    return Export(path=path, rows=counted[0], columns=len(columns))


def _about(database: "Database", where: str | None) -> dict[str, str]:
    manifest = database.manifest
    return {
        "database": str(database.store),
        "hash": manifest.hash,
        "where": where or "",
        "sensors": ", ".join(database.sensors),
        "sigdb_version": manifest.sigdb_version,
        "licence": manifest.licence,
        "citation": manifest.citation,
    }


def _list_sizes(database: "Database", where: str | None, columns: list[ExportColumn]) -> dict[str, int]:
    """Bytes of each matrix, from the number of rows and the greatest tooth count, before anything large is read."""
    rows, teeth = 0, 0
    for batch in database.batches(where, columns=["teeth"], rows=65536):
        rows, teeth = rows + batch.num_rows, max(teeth, batch["teeth"].to_numpy().max())
    n = teeth * int(database.manifest.resolved["signature"]["samples_per_tooth"])
    widths = {"tsa": n} | {name: math.prod(feature.shape(teeth=teeth, n=n)) for name, feature in FEATURES.items()}
    return {
        column.name: 4 * int(rows) * int(widths[column.field.name.split("__")[0]])
        for column in columns
        if column.is_list
    }
