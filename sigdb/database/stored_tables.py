"""The finished parts of a database: tables as Arrow datasets, rows by id or in batches, connections for SQL."""

import re
import threading
import weakref
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from functools import cached_property, partial
from os import PathLike
from types import TracebackType
from typing import Self, Unpack

import numpy as np
import pyarrow as pa
import pyarrow.dataset as ds

from sigdb.core import DatabaseError, InputError, IntArray, __version__
from sigdb.database.added.added_set import AddedSet, current_parts, file_of, read_added_sets
from sigdb.database.added.joined_parquet import JoinedParquet
from sigdb.database.limits import DEFAULT_LIMITS, LimitOptions, QueryLimits
from sigdb.database.query import (
    Connection,
    Engine,
    check_columns,
    check_row_count,
    check_table,
    describe_columns,
    signal_batches,
)
from sigdb.database.signals import AbsentRowError, Lists, decoded_lists, plain_lists, row_blocks
from sigdb.database.store.checked import CheckedParquet, PartTable
from sigdb.database.store.checked_dataset import CheckedDataset
from sigdb.database.store.manifest import Manifest, read_manifest
from sigdb.database.store.plain_lists import PlainLists
from sigdb.database.store.receipts import KINDS, Receipt, read_receipts
from sigdb.database.store.schema import TABLES, read_schema, suffixed
from sigdb.database.store.store import Store
from sigdb.database.store.writer import ROW_GROUP
from sigdb.database.virtual.query_cost import CostDataset, CostRecord
from sigdb.database.virtual.virtual_table import RowMakers, VirtualTable, part_table
from sigdb.signature import FEATURES

_PART_KIND = {"templates": "templates", "features": "rows", "signals": "rows"}


class StoredTables:
    """The finished parts of a database, as of its opening.

    Its columns are those that the database was made with, whatever this version of sigdb would store, and those that
    functions of its user have added.
    """

    def __init__(self, location: str | PathLike[str] | Store) -> None:
        self.store = Store.at(location)
        self.manifest: Manifest = read_manifest(self.store)
        hashes = {plan.hash for plan in self.manifest.plans}
        self._receipts: dict[str, dict[int, Receipt]] = {
            name: {receipt.part: receipt for receipt in read_receipts(self.store, name, hashes)} for name in KINDS
        }
        self._added: list[tuple[AddedSet, dict[int, Receipt]]] = [
            (added, current_parts(self.store, added, self._receipts["rows"])) for added in read_added_sets(self.store)
        ]
        self._tables: dict[str, tuple[PartTable, ...]] = {}
        self._makers = RowMakers(self.store)
        self._plain: dict[int, PlainLists] = {}
        self._lock, self._closed = threading.Lock(), False
        self._shared: Engine | None = None
        self._engines: weakref.WeakSet[Engine] = weakref.WeakSet()

    def __len__(self) -> int:
        """Number of finished rows."""
        return sum(receipt.rows for receipt in self._receipts["rows"].values())

    @property
    def lacks(self) -> str:
        """How much of the database is finished, in words; empty if all of it is."""
        if self.manifest.is_measured:
            done, parts = len(self.receipts("rows")), sum(plan.parts or 0 for plan in self.manifest.plans)
            return f"{done} of {parts} parts" if done < parts else ""
        return f"{len(self)} of {self.manifest.rows} rows" if len(self) < self.manifest.rows else ""

    @property
    def work(self) -> str:
        """The work that makes the database, in a word: a sweep, or an ingest of recordings."""
        return "ingest" if self.manifest.is_measured else "sweep"

    @property
    def sensors(self) -> tuple[str, ...]:
        """Stored sensors; the first one's columns have no suffix."""
        return self.manifest.sensors

    def receipts(self, name: str) -> list[Receipt]:
        """Return the receipts of the finished parts, ``templates`` or ``rows``."""
        return list(self._receipts[name].values())

    @property
    def added(self) -> tuple[AddedSet, ...]:
        """Sets of added features, whose columns stand behind the others of ``features``."""
        return tuple(added for added, _ in self._added)

    def stored_sensor(self, sensor: str | None) -> str:
        """Return a stored sensor by name, the first one if None.

        Raises
        ------
        InputError
            If the database has no such sensor.
        """
        if sensor is not None and sensor not in self.sensors:
            raise InputError(f"sensor {sensor!r} is not stored in {self.store}; stored: {', '.join(self.sensors)}")
        return sensor or self.sensors[0]

    def dataset(self, table: str) -> ds.Dataset:
        """Return the finished parts of a table as an Arrow dataset, whose reads are compared with checksums.

        It has ``schema``, ``to_table``, ``to_batches``, ``head``, ``take``, ``count_rows`` and ``scanner``. It refuses
        the other methods of Arrow's datasets.

        Parameters
        ----------
        table : {"templates", "features", "signals"}
            Name of the table.

        Raises
        ------
        DatabaseError
            If no part is finished, or a part is damaged.
        """
        with self._reading():
            return self._dataset(table)

    def scan(self, table: str, columns: Sequence[str], parts: Container[int] | None = None) -> Iterator[pa.RecordBatch]:
        """Yield some columns of a table, batch by batch, without SQL; of some parts where they are named."""
        with self._reading():
            if parts is None:
                yield from self.dataset(table).to_batches(columns=list(columns))
                return
            kind = self._receipts[_PART_KIND[table]]
            for part, file in zip(kind, self._files(table), strict=True):
                if part in parts:
                    yield from file.read(range(len(file.group_rows)), columns).to_batches()

    def batches(
        self,
        where: str | None = None,
        *,
        table: str = "features",
        columns: Sequence[str] | None = None,
        rows: int = 2048,
        **limits: Unpack[LimitOptions],
    ) -> pa.RecordBatchReader:
        """Return rows of a table in Arrow batches, in the order of their ids.

        Memory holds a few batches and row groups.

        Parameters
        ----------
        where : str, optional
            A condition as in :meth:`cases`, on columns of ``features`` also for ``signals``, on columns of
            ``templates`` for ``templates``.
        table : {"features", "signals", "templates"}
            Name of the table.
        columns : sequence of str, optional
            Columns by name; all columns of the table if left out.
        rows : int
            Greatest number of rows in a batch.
        **limits
            ``max_seconds`` and ``max_memory_gb`` of finding the rows, as in :meth:`sql`.

        Returns
        -------
        pyarrow.RecordBatchReader
            An iterator of record batches. The field of each column carries its unit, description and formula.

        Raises
        ------
        InputError
            If ``where``, ``table`` or ``columns`` name a thing that does not exist.
        DatabaseError
            If a part is damaged: when the stream comes to it.

        Examples
        --------
        Mean square of every signal with damage at tooth 6::

            for batch in db.batches("tooth = 6", table="signals", columns=["id", "tsa"]):
                tsa = np.stack(batch["tsa"].to_numpy(zero_copy_only=False))
                square = (tsa**2).mean(axis=1)
        """
        check_table(table)
        check_row_count(rows)
        schema = self.dataset(table).schema
        names = check_columns(schema, table, columns, self.why_absent)
        connect = partial(self.connect, limits=QueryLimits(**limits))
        with self._reading():
            if table != "signals":
                return describe_columns(connect().choose_batches(table, where, names, rows), schema)
            ids = connect().choose_batches("features", where, ["id"], rows)
            return signal_batches(ids, lambda some: self._signal_rows(some, names), names, schema)

    def signal_rows(self, ids: IntArray, columns: Sequence[str]) -> pa.Table:
        """Return columns of ``signals`` of rows by ascending ids."""
        return pa.concat_tables(rows.select(columns) for _, rows in self._signal_rows(ids, columns))

    def why_absent(self, text: str) -> str:
        """Return why the database lacks a column that a text names.

        Another version of sigdb may know more columns than that which made the database.

        Parameters
        ----------
        text : str
            Name of a column, or SQL text.

        Returns
        -------
        str
            A sentence; empty if the text names no column that only this version of sigdb would store.
        """
        for name in self._absent_features:
            if re.search(rf"\b{re.escape(name)}\b", text):
                return (
                    f"{self.store} lacks the column {name}, which sigdb {self.manifest.sigdb_version} did not store; "
                    f"make the database again with sigdb {__version__} in another directory, or leave the column out"
                )
        return ""

    @cached_property
    def _absent_features(self) -> list[str]:
        present = {name for table in ("features", "signals") for name in self.dataset(table).schema.names}
        names = [suffixed(name, self.sensors, sensor) for sensor in self.sensors for name in FEATURES]
        return [name for name in names if name not in present]

    def _dataset(self, table: str, errors: list[DatabaseError] | None = None) -> ds.Dataset:
        if table == "templates" and self.manifest.is_measured:  # recordings have none
            return ds.dataset(read_schema(self.store).arrow(table).empty_table())
        return CheckedDataset(self._files(table), errors)

    def _files(self, table: str) -> tuple[PartTable, ...]:
        if table not in self._tables:
            receipts = self._receipts[_PART_KIND[table]].values()
            if not receipts:
                raise DatabaseError(
                    f"{self.store}: no {table} are finished yet; run the {self.work} that makes this database"
                )
            self._tables[table] = tuple(self._file(table, receipt) for receipt in receipts)
        return self._tables[table]

    def _file(self, table: str, receipt: Receipt) -> PartTable:
        """Return a table of a part, with its added features."""
        file = part_table(self.store, receipt, table, self._makers)
        if table != "features" or not self._added:
            return file
        file = file.in_groups(ROW_GROUP["features"]) if isinstance(file, VirtualTable) else file
        parts = [(added, parts.get(receipt.part)) for added, parts in self._added]
        return JoinedParquet(
            file, [(added, CheckedParquet(self.store, file_of(added, part)) if part else None) for added, part in parts]
        )

    def _signal_lists(self, ids: IntArray, columns: Mapping[str, str]) -> Iterator[tuple[IntArray, Lists]]:
        """Lists of rows of ``signals`` with their places among the ids; see :func:`row_matrices`."""
        order = np.argsort(ids, kind="stable")
        in_part, others = ids // self.manifest.part_rows, np.full(ids.size, True)
        for places in np.split(order, np.flatnonzero(np.diff(in_part[order])) + 1):
            receipt = self._receipts["rows"].get(int(in_part[places[0]])) if places.size else None
            file = self._plain_file(receipt) if receipt is not None else None
            if receipt is None or file is None:
                continue
            present = places[ids[places] < receipt.first + receipt.rows]
            with self._reading():
                for here, lists in plain_lists(file, columns, present, ids[present] - receipt.first):
                    others[here] = False
                    yield here, lists
        for places, rows in self._signal_rows(ids[others], columns.values()):
            yield np.flatnonzero(others)[places], decoded_lists(rows, columns)

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
            file = self._signal_files[part]
            present = [group for group in groups if group < len(file.group_rows)]
            return file.read(present, columns)

    def _plain_file(self, receipt: Receipt) -> PlainLists | None:
        """Return the file of ``signals`` of a part whose rows can be read without decoding; None where they cannot."""
        if self.store.folder is None or receipt.is_virtual:
            return None
        record = receipt.file("signals")
        if record.plain and receipt.part not in self._plain:
            self._plain[receipt.part] = PlainLists(self.store, record)
        return self._plain.get(receipt.part)

    @cached_property
    def _signal_files(self) -> dict[int, PartTable]:
        """Files of ``signals`` by part; their footers are read once."""
        return dict(zip(self._receipts["rows"], self._files("signals"), strict=True))

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Raise damage of a part as an error of the database."""
        try:
            yield
        except (OSError, pa.ArrowInvalid) as error:
            raise DatabaseError(f"{self.store}: a part is damaged: {error}") from None
        except DatabaseError as error:
            # Arrow keeps an error that a file's Python raised, and by its traceback all that was in use then.
            error.__traceback__ = None
            raise copy(error) from None

    def close(self) -> None:
        """End all queries, also those whose batches are read in part only; the database may not be queried again."""
        with self._lock:
            self._closed = True
            for engine in self._engines:
                engine.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def virtual_rows(self) -> int:
        """Number of rows that are made when they are read."""
        return sum(receipt.rows for receipt in self.receipts("rows") if receipt.is_virtual)

    def cost_connection(self, record: CostRecord) -> Connection:
        """Return a connection for one query, whose scans read nothing and add to a record what they would make."""
        return self._connection(lambda table: CostDataset(self._files(table), record), DEFAULT_LIMITS, [])

    def connect(self, tables: Mapping[str, pa.Table] | None = None, limits: QueryLimits = DEFAULT_LIMITS) -> Connection:
        """Return a new connection for one query, to some tables or to those of the database."""
        if tables is not None:
            return Connection(self._engine(limits), tables, limits=limits)
        errors: list[DatabaseError] = []
        return self._connection(lambda table: self._dataset(table, errors), limits, errors)

    def _connection(
        self, dataset: Callable[[str], ds.Dataset], limits: QueryLimits, errors: list[DatabaseError]
    ) -> Connection:
        with self._reading():
            datasets = {table: dataset(table) for table in TABLES}
        scalars = [f'"{field.name}"' for field in datasets["features"].schema if not pa.types.is_list(field.type)]
        cases = f"select {', '.join(scalars)} from features"
        return Connection(
            self._engine(limits),
            datasets,
            {"cases": cases},
            errors=errors,
            why_absent=self.why_absent,
            limits=limits,
        )

    def _engine(self, limits: QueryLimits) -> Engine:
        """The instance of DuckDB that all queries share; one for this query where its limit of memory is another."""
        with self._lock:
            if self._closed:
                raise DatabaseError(f"{self.store}: this database was closed; open it again with sigdb.open")
            usual = limits.max_memory_gb == DEFAULT_LIMITS.max_memory_gb
            if usual and self._shared is not None:
                return self._shared
            engine = Engine(limits.max_memory_gb)
            self._engines.add(engine)
            if usual:
                self._shared = engine
            return engine


def check_complete(database: StoredTables, columns: Sequence[str] = ()) -> None:
    """Refuse a database whose sweep is not finished, or that lacks columns of ``features``.

    Raises
    ------
    DatabaseError
        If rows or columns are lacking, with what to do.
    """
    if database.lacks:
        raise DatabaseError(
            f"{database.store} has {database.lacks}; finish the {database.work} first, with the command that began it"
        )
    for name in sorted(set(columns) - set(database.dataset("features").schema.names)):
        why = f"{database.store} lacks the column {name}; give a database that has it"
        raise DatabaseError(database.why_absent(name) or why)
