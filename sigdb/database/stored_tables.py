"""The finished parts of a database: tables as Arrow datasets, rows by id, a connection for SQL."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from os import PathLike
from typing import Any

import pyarrow as pa
import pyarrow.dataset as ds
import pyarrow.parquet as pq

from sigdb.core import DatabaseError, InputError, IntArray
from sigdb.database.query import connect
from sigdb.database.signals import AbsentRowError, row_blocks
from sigdb.database.store.checked import open_checked
from sigdb.database.store.manifest import Manifest, read_manifest
from sigdb.database.store.receipts import KINDS, Receipt, read_receipts
from sigdb.database.store.store import Store

_PARQUET = ds.ParquetFileFormat()
_PART_KIND = {"templates": "templates", "features": "rows", "signals": "rows"}


class StoredTables:
    """What of a database was finished when it was opened."""

    def __init__(self, location: str | PathLike[str] | Store) -> None:
        self.store = Store.at(location)
        self.manifest: Manifest = read_manifest(self.store)
        hashes = {plan.hash for plan in self.manifest.plans}
        self._receipts: dict[str, dict[int, Receipt]] = {
            name: {receipt.part: receipt for receipt in read_receipts(self.store, name, hashes)} for name in KINDS
        }

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

    def scan(self, table: str, columns: Sequence[str]) -> Iterator[pa.RecordBatch]:
        """Some columns of a table, batch by batch, without SQL."""
        with self._reading():
            yield from self.dataset(table).to_batches(columns=list(columns))

    def receipts(self, name: str) -> list[Receipt]:
        """Receipts of the finished parts, ``templates`` or ``rows``."""
        return list(self._receipts[name].values())

    def stored_sensor(self, sensor: str | None) -> str:
        """A stored sensor by name, the first one if None."""
        if sensor is not None and sensor not in self.sensors:
            raise InputError(f"sensor {sensor!r} is not stored in {self.store}; stored: {', '.join(self.sensors)}")
        return sensor or self.sensors[0]

    def signal_rows(self, ids: IntArray, columns: Sequence[str]) -> pa.Table:
        """Rows of ``signals`` by ascending ids."""
        return pa.concat_tables(rows.select(columns) for _, rows in self._signal_rows(ids, columns))

    def _signal_rows(self, ids: IntArray, columns: Iterable[str]) -> Iterator[tuple[IntArray, pa.Table]]:
        """Rows of ``signals``, a few row groups at a time; see :func:`row_blocks`."""
        names = list(dict.fromkeys(["id", *columns]))
        try:
            yield from row_blocks(lambda part, groups: self._groups(part, groups, names), self.manifest.part_rows, ids)
        except AbsentRowError as error:
            raise InputError(f"id {error.id} is not in {self.store}, which has {len(self)} finished rows") from None

    def _groups(self, part: int, groups: Sequence[int], columns: Sequence[str]) -> pa.Table:
        """Row groups of a part of ``signals``; no rows where they do not exist."""
        if part not in self._receipts["rows"]:
            return pa.table({"id": pa.array([], pa.int64())})
        with self._reading():
            file = pq.ParquetFile(open_checked(self.store, self._receipts["rows"][part].file("signals")))
            return file.read_row_groups([one for one in groups if one < file.num_row_groups], columns=list(columns))

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Tell of damage in a part, wherever it is met."""
        try:
            yield
        except (OSError, pa.ArrowInvalid) as error:
            raise DatabaseError(f"{self.store}: a part is damaged: {error}") from None
        except DatabaseError as error:
            # Arrow keeps an error that a file's Python raised, and by its traceback all that was in use then.
            error.__traceback__ = None
            raise type(error)(str(error)) from None

    @cached_property
    def _connection(self) -> Any:
        return self._connect()

    def _connect(self) -> Any:
        """A connection of its own: a stream keeps it busy until its end."""
        tables = {table: self.dataset(table) for table in ("templates", "features", "signals")}
        scalars = [f'"{field.name}"' for field in tables["features"].schema if not pa.types.is_list(field.type)]
        return connect(tables, {"cases": f"select {', '.join(scalars)} from features"})
