"""Export of rows of a database to files that MATLAB reads."""

from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

import numpy as np
import pyarrow.compute as pc

from sigdb.core import InputError, publish
from sigdb.database.export.columns import ExportColumn, export_batches, export_columns
from sigdb.database.export.hdf5 import write_hdf5
from sigdb.database.export.mat import check_size, write_mat
from sigdb.database.limits import LimitOptions
from sigdb.database.stored_tables import StoredTables

_WRITERS = {".mat": write_mat, ".h5": write_hdf5, ".hdf5": write_hdf5}
_BATCH = 2048
"""Rows that are read and written together: their arrays are in memory at once."""


@dataclass(frozen=True, kw_only=True)
class Export:
    """A file that rows of a database were written to.

    Attributes
    ----------
    path : pathlib.Path
        The file.
    rows, columns : int
        Numbers of rows and columns in it.
    """

    path: Path
    rows: int
    columns: int


def export_database(
    tables: StoredTables,
    path: str | Path,
    *,
    where: str | None,
    signals: bool,
    sensor: str | None,
    **limits: Unpack[LimitOptions],
) -> Export:
    """Write rows to a file; see :meth:`Database.export`."""
    path = Path(path)
    write = _WRITERS.get(path.suffix.lower())
    if write is None:
        raise InputError(f"{path}: the name of an export ends in .mat, .h5 or .hdf5; give such a name")
    columns = export_columns(tables, signals=signals, sensor=sensor)
    if write is write_mat:
        check_size(_list_sizes(tables, where, columns, **limits))
    rows: list[int] = []
    batches = export_batches(tables, where, columns, _BATCH, **limits)
    about = _about(tables, where)
    publish(path, lambda temporary: rows.append(write(temporary, columns, batches, about)))
    return Export(path=path, rows=rows[0], columns=len(columns))


def _about(tables: StoredTables, where: str | None) -> dict[str, str]:
    manifest = tables.manifest
    return {
        "database": str(tables.store),
        "hash": manifest.hash,
        "where": where or "",
        "sensors": ", ".join(tables.sensors),
        "sigdb_version": manifest.sigdb_version,
        "licence": manifest.licence,
        "citation": manifest.citation,
    }


def _list_sizes(
    tables: StoredTables, where: str | None, columns: list[ExportColumn], **limits: Unpack[LimitOptions]
) -> dict[str, int]:
    """Bytes of each matrix before it is read: the rows times the lists of a row of the greatest tooth count."""
    rows, teeth, longest = 0, 0, None
    for batch in tables.batches(where, columns=["id", "teeth", "status"], rows=65536, **limits):
        rows += batch.num_rows
        done = batch.filter(pc.equal(batch["status"], "ok"))
        if done.num_rows and pc.max(done["teeth"]).as_py() > teeth:
            place = int(np.argmax(done["teeth"].to_numpy()))
            teeth, longest = done["teeth"][place].as_py(), done["id"][place].as_py()
    lists = [column for column in columns if column.is_list]
    if longest is None:
        return dict.fromkeys((column.name for column in lists), 0)
    (row,) = export_batches(tables, f"id = {longest}", lists, 1, **limits)
    return {name: rows * np.asarray(values).nbytes for name, values in row.items()}
