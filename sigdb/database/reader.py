"""Reading a database: cases, SQL, signals, templates."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from numpy.typing import ArrayLike

from sigdb.core.errors import DatabaseError, InputError
from sigdb.core.typing import FloatArray, IntArray
from sigdb.database.checked import open_checked
from sigdb.database.manifest import Manifest, read_manifest
from sigdb.database.query import connect, select
from sigdb.database.receipts import KINDS, Receipt, read_receipts
from sigdb.database.storage import Store
from sigdb.database.writer import ROW_GROUP

_PARQUET = ds.ParquetFileFormat()
_PART_KIND = {"templates": "templates", "features": "rows", "signals": "rows"}


class Database:
    """A database that is read; see :func:`sigdb.open`.

    Readers follow receipts, so a sweep may go on writing meanwhile: what was finished when the database was opened
    is what is seen.
    """

    def __init__(self, location: str | PathLike[str] | Store) -> None:
        self.store = Store.at(location)
        self.manifest: Manifest = read_manifest(self.store)
        hashes = {plan.hash for plan in self.manifest.plans}
        self._receipts: dict[str, dict[int, Receipt]] = {
            name: {receipt.part: receipt for receipt in read_receipts(self.store, name, hashes)} for name in KINDS
        }

    def __repr__(self) -> str:
        return f"Database({str(self.store)!r}, {len(self)} of {self.manifest.rows} rows)"

    def __len__(self) -> int:
        """Number of finished rows."""
        return sum(receipt.rows for receipt in self._receipts["rows"].values())

    @property
    def sensors(self) -> tuple[str, ...]:
        """Stored sensors; the first one's columns have no suffix."""
        return self.manifest.sensors

    def dataset(self, table: str) -> ds.Dataset:
        """The finished parts of a table as an Arrow dataset; whatever it reads is compared with its checksums.

        Parameters
        ----------
        table
            ``templates``, ``features`` or ``signals``.
        """
        receipts = self._receipts[_PART_KIND[table]].values()
        if not receipts:
            raise DatabaseError(f"{self.store}: no {table} are finished yet; run the sweep that makes this database")
        with self._reading():
            parts = [_PARQUET.make_fragment(open_checked(self.store, receipt.file(table))) for receipt in receipts]
            return ds.FileSystemDataset(parts, parts[0].physical_schema, _PARQUET)

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Tell of damage in a part, wherever it is met."""
        try:
            yield
        except (OSError, pa.ArrowInvalid) as error:
            raise DatabaseError(f"{self.store}: a part is damaged: {error}") from None

    @cached_property
    def _connection(self) -> Any:
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
            A condition in SQL, for example ``"tooth = 6 and stiffness_loss >= 0.25"``; all rows if left out.
        """
        condition = f" where ({where}\n)" if where else ""
        return self.sql(f"select * from cases{condition} order by id")

    def features(self, where: str | None = None) -> pd.DataFrame:
        """Rows with their pooled Wigner-Ville features, by id; ``where`` as in :meth:`cases`."""
        condition = f" where ({where}\n)" if where else ""
        return self.sql(f"select * from features{condition} order by id")

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
        rows: dict[int, dict[str, Any]] = {}
        for first in np.unique(wanted // ROW_GROUP["signals"]) * ROW_GROUP["signals"]:
            rows |= self._row_group(int(first), columns, set(wanted.tolist()))
        lengths = {len(row["tsa"]) for row in rows.values() if row["tsa"] is not None}
        if len(lengths) > 1:
            raise InputError(
                f"rows have signals of different lengths {sorted(lengths)}; ask for one tooth count at a time"
            )
        (n,) = lengths or {self._length(wanted)}
        missing = {"tsa": np.full(n, np.nan), "spectrum": np.full(n // 2 + 1 if n else 0, np.nan)}
        return {
            key: np.array(
                [missing[key] if rows[i][key] is None else rows[i][key] for i in wanted.tolist()], dtype=np.float32
            )
            for key in columns
        }

    def _length(self, ids: IntArray) -> int:
        """Samples of a row that has no signal of its own to tell."""
        if not ids.size:
            return 0
        teeth = self.sql(f"select teeth from cases where id = {ids[0]}")["teeth"].iloc[0]
        return int(teeth) * int(self.manifest.resolved["signature"]["samples_per_tooth"])

    def _sensor_columns(self, sensor: str | None) -> dict[str, str]:
        if sensor is not None and sensor not in self.sensors:
            raise InputError(f"sensor {sensor!r} is not stored in {self.store}; stored: {', '.join(self.sensors)}")
        suffix = "" if sensor in (None, self.sensors[0]) else f"__{sensor}"
        return {key: key + suffix for key in ("tsa", "spectrum")}

    def _row_group(self, first: int, columns: dict[str, str], wanted: set[int]) -> dict[int, dict[str, Any]]:
        part, within = divmod(first, self.manifest.part_rows)
        inside = {i for i in wanted if first <= i < first + ROW_GROUP["signals"]}
        if part not in self._receipts["rows"]:
            raise InputError(f"id {min(inside)} is not in {self.store}, which has {len(self)} finished rows")
        with self._reading():
            file = pq.ParquetFile(open_checked(self.store, self._receipts["rows"][part].file("signals")))
            group = within // ROW_GROUP["signals"]
            if group >= file.num_row_groups:
                raise InputError(f"id {max(inside)} is not in {self.store}, which has {len(self)} finished rows")
            table = file.read_row_group(group, columns=["id", *columns.values()])
        absent = inside - set(table["id"].to_pylist())
        if absent:
            raise InputError(f"id {min(absent)} is not in {self.store}, which has {len(self)} finished rows")
        lists = {key: table[column] for key, column in columns.items()}
        return {
            i: {
                key: values[i - first].values.to_numpy() if values[i - first].is_valid else None
                for key, values in lists.items()
            }
            for i in inside
        }


def open(location: str | PathLike[str]) -> Database:
    """Open a database for reading.

    Parameters
    ----------
    location
        The directory that a sweep wrote, or its place in an object store: ``s3://bucket/prefix``.

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
    return Database(location)


def check_complete(database: Database, columns: Sequence[str] = ()) -> None:
    """Refuse a database whose sweep is not finished, or that lacks columns.

    Raises
    ------
    DatabaseError
        Says how many rows there are and what to do.
    """
    if len(database) < database.manifest.rows:
        raise DatabaseError(
            f"{database.store} has {len(database)} of {database.manifest.rows} rows; finish the sweep first, "
            "with the same command that began it"
        )
    lacking = set(columns) - set(database.dataset("features").schema.names)
    if lacking:
        raise DatabaseError(f"{database.store} lacks the columns {sorted(lacking)}")
