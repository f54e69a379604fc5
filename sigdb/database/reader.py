"""Reading a database: cases, SQL, signals, templates."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from numpy.typing import ArrayLike

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.typing import FloatArray, IntArray
from sigdb.database.manifest import Manifest, read_manifest
from sigdb.database.query import choose, connect, select
from sigdb.database.receipts import Receipt, part_name, read_receipts
from sigdb.database.signals import AbsentRowError, row_blocks, row_matrices

_CHECKED = ds.ParquetFileFormat(
    default_fragment_scan_options=ds.ParquetFragmentScanOptions(page_checksum_verification=True)
)
_PART_KIND = {"templates": "templates", "features": "rows", "signals": "rows"}


class Database:
    """A database that is read; see :func:`sigdb.open`.

    Readers follow receipts, so a sweep may go on writing meanwhile: what was finished when the database was opened
    is what is seen.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.manifest: Manifest = read_manifest(self.path)
        self._receipts: dict[str, list[Receipt]] = {
            name: read_receipts(self.path, name) for name in ("templates", "rows")
        }

    def __repr__(self) -> str:
        return f"Database({str(self.path)!r}, {len(self)} of {self.manifest.rows} rows)"

    def __len__(self) -> int:
        """Number of finished rows."""
        return sum(receipt.rows for receipt in self._receipts["rows"])

    @property
    def sensors(self) -> tuple[str, ...]:
        """Stored sensors; the first one's columns have no suffix."""
        return self.manifest.sensors

    def dataset(self, table: str) -> ds.Dataset:
        """The finished parts of a table as an Arrow dataset that checks page checksums.

        Parameters
        ----------
        table
            ``templates``, ``features`` or ``signals``.
        """
        parts = [receipt.part for receipt in self._receipts[_PART_KIND[table]]]
        files = [str(self.path / table / part_name(part)) for part in parts]
        if not files:
            raise DatabaseError(f"{self.path}: no {table} are finished yet; run the sweep that makes this database")
        with self._reading():
            return ds.dataset(files, format=_CHECKED)

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Tell of damage in a part, wherever it is met."""
        try:
            yield
        except (OSError, pa.ArrowInvalid) as error:
            raise DatabaseError(f"{self.path}: a part is damaged: {error}") from None

    @cached_property
    def _connection(self) -> Any:
        return self._connect()

    def _connect(self) -> Any:
        """A connection of its own: a stream keeps it busy until its end."""
        tables = {table: self.dataset(table) for table in ("templates", "features", "signals")}
        scalars = [f'"{field.name}"' for field in tables["features"].schema if not pa.types.is_list(field.type)]
        return connect(tables, {"cases": f"select {', '.join(scalars)} from features"})

    def arrow(self, query: str) -> pa.Table:
        """The result of one SELECT statement as an Arrow table; see :meth:`sql`."""
        with self._reading():
            return select(self._connection, query)

    def sql(self, query: str) -> pd.DataFrame:
        """Run one SELECT statement.

        The views are ``features`` (all columns of a row), ``cases`` (the same without lists), ``signals`` (``id``,
        ``tsa``, ``spectrum``) and ``templates``.

        Parameters
        ----------
        query
            One SELECT statement in DuckDB's SQL.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        InputError
            If it is not one SELECT statement, or names what does not exist.
        DatabaseError
            If a part that it reads is damaged.
        """
        return self.arrow(query).to_pandas()

    def cases(self, where: str | None = None) -> pd.DataFrame:
        """Rows without their lists: parameters, labels, indicators, by id.

        Parameters
        ----------
        where
            One SQL expression, for example ``"tooth = 6 and stiffness_loss >= 0.25"``; all rows if left out. It is
            parsed as an expression, so that nothing can be smuggled in behind it. Subqueries over the views may stand
            in it.

        Raises
        ------
        InputError
            If ``where`` is not one expression, or names what does not exist.
        """
        with self._reading():
            return choose(self._connection, "cases", where, order="id").to_pandas()

    def features(self, where: str | None = None) -> pd.DataFrame:
        """Rows with their pooled Wigner-Ville features, by id; ``where`` as in :meth:`cases`."""
        with self._reading():
            return choose(self._connection, "features", where, order="id").to_pandas()

    def unit(self, column: str, sensor: str | None = None) -> str:
        """Unit of a sensor's column of signals, ``tsa`` or ``spectrum``."""
        field = self.dataset("signals").schema.field(self._sensor_columns(sensor)[column])
        return str(field.metadata[b"unit"].decode())

    def templates(self) -> pd.DataFrame:
        """The templates: each distinct case once, damage at tooth 1."""
        with self._reading():
            return self.dataset("templates").to_table().to_pandas()

    def signals(self, ids: ArrayLike, *, sensor: str | None = None) -> dict[str, FloatArray]:
        """Averaged signals and order spectra of rows, found by arithmetic on their ids.

        Parameters
        ----------
        ids
            (k,) ids.
        sensor
            Name of a stored sensor; the first one if left out.

        Returns
        -------
        dict
            ``tsa`` (k, n) and ``spectrum`` (k, n // 2 + 1), float32, in the order of ``ids``; rows without a result
            are nan.

        Raises
        ------
        InputError
            If an id or the sensor is not in the database, or the rows have different lengths (other tooth counts).
        DatabaseError
            If a part is damaged.
        """
        wanted = np.atleast_1d(np.asarray(ids))
        if wanted.size and wanted.dtype.kind not in "iu":
            raise InputError(f"ids must be whole numbers, not {wanted.dtype} such as {wanted.flat[0]}")
        wanted = wanted.astype(np.int64)
        columns = self._sensor_columns(sensor)
        found = row_matrices(self._signal_rows(wanted, columns.values()), columns, wanted.size)
        if not found:  # none of the rows has a result that would tell the length
            n = self._length(wanted)
            widths = {"tsa": n, "spectrum": n // 2 + 1 if n else 0}
            return {key: np.full((wanted.size, width), np.nan, np.float32) for key, width in widths.items()}
        return found

    def _length(self, ids: IntArray) -> int:
        """Samples of a row that has no signal of its own to tell."""
        if not ids.size:
            return 0
        teeth = self.sql(f"select teeth from cases where id = {ids[0]}")["teeth"].iloc[0]
        return int(teeth) * int(self.manifest.resolved["signature"]["samples_per_tooth"])

    def _sensor_columns(self, sensor: str | None) -> dict[str, str]:
        if sensor is not None and sensor not in self.sensors:
            raise InputError(f"sensor {sensor!r} is not stored in {self.path}; stored: {', '.join(self.sensors)}")
        suffix = "" if sensor in (None, self.sensors[0]) else f"__{sensor}"
        return {key: key + suffix for key in ("tsa", "spectrum")}

    def _signal_rows(self, ids: IntArray, columns: Iterable[str]) -> Iterator[tuple[IntArray, pa.Table]]:
        """Rows of ``signals``, a few row groups at a time; see :func:`row_blocks`."""
        names = list(dict.fromkeys(["id", *columns]))
        try:
            yield from row_blocks(lambda part, groups: self._groups(part, groups, names), self.manifest.part_rows, ids)
        except AbsentRowError as error:
            raise InputError(f"id {error.id} is not in {self.path}, which has {len(self)} finished rows") from None

    def _groups(self, part: int, groups: Sequence[int], columns: Sequence[str]) -> pa.Table:
        """Row groups of a part of ``signals``; no rows where they do not exist."""
        if part not in {receipt.part for receipt in self._receipts["rows"]}:
            return pa.table({"id": pa.array([], pa.int64())})
        path = self.path / "signals" / part_name(part)
        try:
            file = pq.ParquetFile(path, page_checksum_verification=True)
            return file.read_row_groups([one for one in groups if one < file.num_row_groups], columns=list(columns))
        except (OSError, pa.ArrowInvalid) as error:
            raise DatabaseError(f"{path} is damaged: {error}") from None

def open(path: str | Path) -> Database:
    """Open a database for reading.

    Parameters
    ----------
    path
        The directory that a sweep wrote.

    Returns
    -------
    Database

    Raises
    ------
    InputError
        If there is no database.
    DatabaseError
        If its receipts and files do not agree.
    """
    return Database(path)


def check_complete(database: Database, columns: Sequence[str] = ()) -> None:
    """Refuse a database whose sweep is not finished, or that lacks columns.

    Raises
    ------
    DatabaseError
        Says how many rows there are and what to do.
    """
    if len(database) < database.manifest.rows:
        raise DatabaseError(
            f"{database.path} has {len(database)} of {database.manifest.rows} rows; finish the sweep first, "
            "with the same command that began it"
        )
    lacking = set(columns) - set(database.dataset("features").schema.names)
    if lacking:
        raise DatabaseError(f"{database.path} lacks the columns {sorted(lacking)}")
