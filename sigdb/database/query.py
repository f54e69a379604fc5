"""SQL over a database: DuckDB on Arrow datasets, read-only and closed to everything outside."""

import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from types import TracebackType
from typing import Self

import duckdb
import pyarrow as pa
import pyarrow.dataset as ds

from sigdb.core import DatabaseError, InputError, IntArray, shown, suggestion
from sigdb.database.limits import DEFAULT_LIMITS, QueryLimits, TimedCalls
from sigdb.database.statement import check_statement, printable_line
from sigdb.database.store.schema import TABLES

_BATCH_ROWS = 16384
"""Rows of a result between two looks at its limits."""


class Engine:
    """An instance of DuckDB that reads no file, writes none and keeps its settings.

    Its connections may be used in several threads, each in one. It is closed when nothing refers to it any more, and
    before Python ends: its threads call Python to read a database.

    Parameters
    ----------
    memory_gb
        Greatest memory of its queries together, GB.
    """

    def __init__(self, memory_gb: float) -> None:
        self._root = duckdb.connect(
            ":memory:",
            config={
                "memory_limit": f"{memory_gb:.6f}GB",
                "temp_directory": "",
                "autoload_known_extensions": False,
                "autoinstall_known_extensions": False,
                "python_enable_replacements": False,
            },
        )
        self._root.execute("set enable_external_access=false")
        self._root.execute("set lock_configuration=true")
        self._cursors: weakref.WeakSet[duckdb.DuckDBPyConnection] = weakref.WeakSet()
        self.close = weakref.finalize(self, _close, self._root, self._cursors)

    def cursor(self) -> duckdb.DuckDBPyConnection:
        """Return a new connection."""
        cursor = self._root.cursor()
        self._cursors.add(cursor)
        return cursor


def _close(root: duckdb.DuckDBPyConnection, cursors: Iterable[duckdb.DuckDBPyConnection]) -> None:
    for connection in (*cursors, root):
        connection.close()


class Connection:
    """A DuckDB connection that sees some views and nothing else, for one query.

    Parameters
    ----------
    engine
        The instance of DuckDB.
    views
        Dataset or table by view name.
    selections
        SQL text of further views by name.
    errors
        The list to which files of the datasets add errors of reading; see :class:`CheckedDataset`. DuckDB passes such
        an error on as text, so it is taken from here.
    why_absent
        Returns why a column that a statement names is absent, or nothing; for messages.
    limits
        Limits of the query.
    """

    def __init__(
        self,
        engine: Engine,
        views: Mapping[str, ds.Dataset | pa.Table],
        selections: Mapping[str, str] | None = None,
        *,
        errors: list[DatabaseError] | None = None,
        why_absent: Callable[[str], str] = lambda text: "",
        limits: QueryLimits = DEFAULT_LIMITS,
    ) -> None:
        self._engine = engine  # which is closed without references
        self._errors: list[DatabaseError] = [] if errors is None else errors
        self._why_absent, self._limits = why_absent, limits
        self._duckdb = engine.cursor()
        self._calls = TimedCalls(limits.max_seconds, self._duckdb.interrupt)
        for name, dataset in views.items():
            self._duckdb.register(name, dataset)
        for name, text in (selections or {}).items():
            self._duckdb.execute(f"create temp view {name} as {text}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the query."""
        self._duckdb.close()
        self._calls.close()

    def select(self, text: str) -> pa.Table:
        """Return the result of one SELECT statement.

        Raises
        ------
        InputError
            If the text is not one SELECT statement, names a thing that does not exist, or reaches a limit.
        DatabaseError
            If a part that it reads is damaged.
        """
        with self._explained("query", text):
            check_statement(self._duckdb, text)
            return self._calls.run(lambda: self._collected(self._duckdb.sql(text)))

    def stream(self, text: str, rows: int) -> pa.RecordBatchReader:
        """Return the result of one SELECT statement in batches, as they are computed.

        The connection is closed at the end of the batches, or when they are given up. Time counts only while a batch is
        computed.

        Raises
        ------
        InputError, DatabaseError
            As :meth:`select`. Damage is raised when the reader comes to it.
        """
        with self._closed_at_errors(), self._explained("query", text):
            check_statement(self._duckdb, text)
            return self._batches(lambda: self._duckdb.sql(text), rows, "query", text)

    def choose(self, view: str, where: str | None) -> pa.Table:
        """Return all rows of a view that meet a condition, in the view's order.

        Parameters
        ----------
        view
            Name of the view.
        where
            One SQL expression, parsed as such: no text can end it and begin something else. It may hold subqueries over
            the views of the connection. None stands for all rows.

        Raises
        ------
        InputError
            If ``where`` is not one expression, or names a thing that does not exist; the message repeats it.
        DatabaseError
            If a part is damaged.
        """
        with self._explained(_owner(where), where or ""):
            self._check_condition(where)
            return self._calls.run(lambda: self._chosen(view, where).to_arrow_table())

    def choose_batches(self, view: str, where: str | None, columns: Sequence[str], rows: int) -> pa.RecordBatchReader:
        """Return rows of a view that meet a condition, in batches in the view's order.

        See :meth:`choose` for the condition and :meth:`stream` for the batches; their number is not limited.
        """
        wanted = ", ".join(f'"{name}"' for name in columns)
        with self._closed_at_errors(), self._explained(_owner(where), where or ""):
            self._check_condition(where)
            chosen = lambda: self._chosen(view, where).project(wanted)  # noqa: E731
            return self._batches(chosen, rows, _owner(where), where or "", limited=False)

    def _check_condition(self, where: str | None) -> None:
        if where is not None:
            check_statement(self._duckdb, f"select ({duckdb.SQLExpression(where)})", _owner(where))

    def _chosen(self, view: str, where: str | None) -> duckdb.DuckDBPyRelation:
        relation = self._duckdb.view(view)
        return relation if where is None else relation.filter(duckdb.SQLExpression(where))

    def _collected(self, relation: duckdb.DuckDBPyRelation) -> pa.Table:
        reader = relation.to_arrow_reader(_BATCH_ROWS)
        return pa.Table.from_batches(self._within_limits(reader), reader.schema)

    def _within_limits(self, batches: Iterable[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
        """Yield batches until they reach the limit of rows or of memory."""
        rows, size = 0, 0
        for batch in batches:
            rows, size = rows + batch.num_rows, size + batch.nbytes
            if rows > self._limits.max_rows:
                raise self._limits.exceeded("max_rows")
            if size > self._limits.max_memory_gb * 1e9:
                raise self._limits.exceeded("max_memory_gb")
            yield batch

    def _batches(
        self,
        relation: Callable[[], duckdb.DuckDBPyRelation],
        rows: int,
        owner: str,
        text: str,
        *,
        limited: bool = True,
    ) -> pa.RecordBatchReader:
        reader = self._calls.run(lambda: relation().to_arrow_reader(rows))

        def read() -> Iterator[pa.RecordBatch]:
            count = 0
            try:
                with self._explained(owner, text):
                    while (batch := self._calls.run(lambda: next(reader, None))) is not None:
                        if not self._engine.close.alive:
                            raise InputError(f"{owner}: the database was closed before all rows were read")
                        count += batch.num_rows
                        if limited and count > self._limits.max_rows:
                            raise self._limits.exceeded("max_rows")
                        yield batch
            finally:
                self.close()

        return pa.RecordBatchReader.from_batches(reader.schema, read())

    @contextmanager
    def _closed_at_errors(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self.close()
            raise

    @contextmanager
    def _explained(self, owner: str, text: str) -> Iterator[None]:
        """Raise what is wrong with the files that are read, or else with the statement."""
        try:
            yield
        except (duckdb.Error, OSError, pa.ArrowInvalid) as error:
            if self._errors:
                raise copy(self._errors[0]) from None
            if self._calls.out_of_time:
                raise self._limits.exceeded("max_seconds") from None
            if isinstance(error, duckdb.OutOfMemoryException):
                raise self._limits.exceeded("max_memory_gb") from None
            why = isinstance(error, duckdb.BinderException) and self._why_absent(text)
            raise InputError(f"{owner}: {why or _sentence(error)}") from None


def _owner(where: str | None) -> str:
    if where is not None and (not isinstance(where, str) or not where.strip()):
        raise InputError(
            f"where = {shown(where)} must be a condition in SQL, for example 'tooth = 6'; leave it out for all rows"
        )
    return "query" if where is None else f"query: where = {shown(where)}"


def _sentence(error: Exception) -> str:
    """An error of DuckDB on one line, without its drawing of the statement."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    hints = [line for line in lines if line.startswith(("Candidate", "Did you mean"))]
    return "; ".join(map(printable_line, [lines[0], *hints]))


SignalRows = Callable[[IntArray], Iterable[tuple[IntArray, pa.Table]]]
"""Returns rows of ``signals`` by ids in ascending order, block by block."""


def check_columns(
    schema: pa.Schema, table: str, columns: Sequence[str] | None, why_absent: Callable[[str], str]
) -> list[str]:
    """Return the columns to read, all if None.

    Parameters
    ----------
    schema
        The table's columns.
    table
        The table's name.
    columns
        The columns by name.
    why_absent
        Returns why a column is absent, or nothing; see :meth:`StoredTables.why_absent`.

    Raises
    ------
    InputError
        If the table has no such column.
    """
    if columns is None:
        return list(schema.names)
    for name in columns:
        if name not in schema.names:
            why = why_absent(name) or f"{table} has no column {name!r}{suggestion(name, schema.names)}"
            raise InputError(f"columns: {why}")
    return list(columns)


def check_table(table: str) -> None:
    """Refuse a table that no database has."""
    if table not in TABLES:
        raise InputError(f"table = {table!r} is not a table of a database{suggestion(table, TABLES)}")


def check_row_count(rows: int) -> None:
    """Refuse batches without rows."""
    if rows < 1:
        raise InputError(f"rows = {rows} must be 1 or more: it is the greatest number of rows in a batch")


def describe_columns(reader: pa.RecordBatchReader, schema: pa.Schema) -> pa.RecordBatchReader:
    """Return batches whose columns carry unit, description and formula, which SQL drops."""
    wanted = pa.schema([schema.field(name) for name in reader.schema.names])
    return pa.RecordBatchReader.from_batches(wanted, (batch.cast(wanted) for batch in reader))


def signal_batches(
    ids: pa.RecordBatchReader, read: SignalRows, columns: Sequence[str], schema: pa.Schema
) -> pa.RecordBatchReader:
    """Return rows of ``signals`` of a stream of ids, a batch for each batch of ids."""
    wanted = pa.schema([schema.field(name) for name in columns])

    def batches() -> Iterator[pa.RecordBatch]:
        for batch in ids:
            blocks = [rows.select(columns) for _, rows in read(batch["id"].to_numpy())]
            yield from pa.concat_tables(blocks).cast(wanted).combine_chunks().to_batches()

    return pa.RecordBatchReader.from_batches(wanted, batches())
