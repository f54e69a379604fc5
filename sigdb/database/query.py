"""SQL over a database: DuckDB on Arrow datasets, read-only and closed to everything outside."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from types import TracebackType
from typing import Self

import duckdb
import pyarrow as pa
import pyarrow.dataset as ds

from sigdb.core import DatabaseError, InputError, IntArray, suggestion
from sigdb.database.store.schema import TABLES


class Connection:
    """A DuckDB connection that sees some views and nothing else.

    Parameters
    ----------
    views
        Dataset or table by view name.
    selections
        SQL text of further views by name.
    errors
        The list to which files of the datasets add errors of reading; see :func:`sigdb.database.open_checked`. DuckDB
        passes such an error on as text, so it is taken from here.
    why_absent
        Returns why a column that a statement names is absent, or nothing; for messages.
    """

    def __init__(
        self,
        views: Mapping[str, ds.Dataset | pa.Table],
        selections: Mapping[str, str] | None = None,
        *,
        errors: list[DatabaseError] | None = None,
        why_absent: Callable[[str], str] = lambda text: "",
    ) -> None:
        self._errors: list[DatabaseError] = [] if errors is None else errors
        self._why_absent = why_absent
        self._duckdb = duckdb.connect(":memory:")
        for name, dataset in views.items():
            self._duckdb.register(name, dataset)
        for name, text in (selections or {}).items():
            self._duckdb.execute(f"create view {name} as {text}")
        for setting in (
            "streaming_buffer_size='1MB'",
            "python_enable_replacements=false",
            "enable_external_access=false",
            "lock_configuration=true",
        ):
            self._duckdb.execute(f"set {setting}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._duckdb.close()

    def select(self, text: str) -> pa.Table:
        """Return the result of one SELECT statement.

        Raises
        ------
        InputError
            If the text is not one SELECT statement, or names a thing that does not exist.
        DatabaseError
            If a part that it reads is damaged.
        """
        self._errors.clear()
        with self._explained("query", text):
            return self._selection(text).to_arrow_table()

    def stream(self, text: str, rows: int) -> pa.RecordBatchReader:
        """Return the result of one SELECT statement in batches, as they are computed.

        The connection serves nothing else then, and is closed at the end of the batches.

        Raises
        ------
        InputError, DatabaseError
            As :meth:`select`. Damage is raised when the reader comes to it.
        """
        with self._explained("query", text):
            return self._batches(self._selection(text), rows, "query", text)

    def choose(self, view: str, where: str | None, *, order: str | None = None) -> pa.Table:
        """Return all rows of a view that meet a condition.

        Parameters
        ----------
        view
            Name of the view.
        where
            One SQL expression, parsed as such: no text can end it and begin something else. It may hold subqueries over
            the views of the connection. None stands for all rows.
        order
            Column to sort by.

        Raises
        ------
        InputError
            If ``where`` is not one expression, or names a thing that does not exist; the message repeats it.
        DatabaseError
            If a part is damaged.
        """
        self._errors.clear()
        with self._explained(_owner(where), where or ""):
            chosen = self._chosen(view, where)
            return (chosen.order(order) if order else chosen).to_arrow_table()

    def choose_batches(self, view: str, where: str | None, columns: Sequence[str], rows: int) -> pa.RecordBatchReader:
        """Return rows of a view that meet a condition, in batches in the view's order.

        See :meth:`choose` for the condition and :meth:`stream` for the batches.
        """
        with self._explained(_owner(where), where or ""):
            chosen = self._chosen(view, where).project(", ".join(f'"{name}"' for name in columns))
            return self._batches(chosen, rows, _owner(where), where or "")

    def _selection(self, text: str) -> duckdb.DuckDBPyRelation:
        statements = self._duckdb.extract_statements(text)
        if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
            raise InputError(f"query {text!r} must be one SELECT statement; a database is read-only")
        return self._duckdb.sql(text)

    def _chosen(self, view: str, where: str | None) -> duckdb.DuckDBPyRelation:
        relation = self._duckdb.view(view)
        return relation if where is None else relation.filter(duckdb.SQLExpression(where))

    def _batches(self, relation: duckdb.DuckDBPyRelation, rows: int, owner: str, text: str) -> pa.RecordBatchReader:
        reader = relation.to_arrow_reader(rows)

        def read() -> Iterator[pa.RecordBatch]:
            try:
                with self._explained(owner, text):
                    yield from reader
            finally:
                self._duckdb.close()

        return pa.RecordBatchReader.from_batches(reader.schema, read())

    @contextmanager
    def _explained(self, owner: str, text: str) -> Iterator[None]:
        """Raise what is wrong with the files that are read, or else with the statement."""
        try:
            yield
        except (duckdb.Error, OSError, pa.ArrowInvalid) as error:
            if self._errors:
                raise copy(self._errors[0]) from None
            why = isinstance(error, duckdb.BinderException) and self._why_absent(text)
            raise InputError(f"{owner}: {why or _sentence(error)}") from None


def _owner(where: str | None) -> str:
    if where is not None and (not isinstance(where, str) or not where.strip()):
        raise InputError(
            f"where = {where!r} must be a condition in SQL, for example 'tooth = 6'; leave it out for all rows"
        )
    return "query" if where is None else f"query: where = {where!r}"


def _sentence(error: Exception) -> str:
    """An error of DuckDB on one line, without its drawing of the statement."""
    lines = [line for line in str(error).splitlines() if line.strip()]
    hints = [line for line in lines if line.startswith(("Candidate", "Did you mean"))]
    return "; ".join([lines[0], *hints])


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
