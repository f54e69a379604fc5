"""Export of a database, or of a part of it, to files that MATLAB reads."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow.compute as pc

from sigdb.core import InputError
from sigdb.database.export.columns import ExportColumn, export_batches, export_columns
from sigdb.database.export.hdf5 import write_hdf5
from sigdb.database.export.mat import check_size, write_mat
from sigdb.database.store.store import publish

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
    """Bytes of each matrix before it is read: the rows times the lists of a row of the greatest tooth count."""
    rows, teeth, longest = 0, 0, None
    for batch in database.batches(where, columns=["id", "teeth", "status"], rows=65536):
        rows += batch.num_rows
        done = batch.filter(pc.equal(batch["status"], "ok"))
        if done.num_rows and pc.max(done["teeth"]).as_py() > teeth:
            place = int(np.argmax(done["teeth"].to_numpy()))
            teeth, longest = done["teeth"][place].as_py(), done["id"][place].as_py()
    lists = [column for column in columns if column.is_list]
    if longest is None:
        return dict.fromkeys((column.name for column in lists), 0)
    (row,) = export_batches(database, f"id = {longest}", lists, 1)
    return {name: rows * values.nbytes for name, values in row.items()}
