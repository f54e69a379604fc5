"""SQL over a database: DuckDB on Arrow datasets, read-only and closed to everything outside."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager

import duckdb
import pyarrow as pa
import pyarrow.dataset as ds

from sigdb.core import DatabaseError, InputError, IntArray, suggestion
from sigdb.database.store.schema import TABLES


def connect(views: Mapping[str, ds.Dataset | pa.Table], selections: Mapping[str, str]) -> duckdb.DuckDBPyConnection:
    """A connection that sees the views and nothing else.

    What the datasets read is compared with its checksums, which DuckDB's own Parquet reader would not do.

    Parameters
    ----------
    views
        Dataset or table by view name.
    selections
        SQL text of further views by name.
    """
    connection = duckdb.connect(":memory:")
    for name, dataset in views.items():
        connection.register(name, dataset)
    for name, text in selections.items():
        connection.execute(f"create view {name} as {text}")
    for setting in (
        "streaming_buffer_size='1MB'",
        "python_enable_replacements=false",
        "enable_external_access=false",
        "lock_configuration=true",
    ):
        connection.execute(f"set {setting}")
    return connection


def select(connection: duckdb.DuckDBPyConnection, text: str) -> pa.Table:
    """The result of one SELECT statement.

    Raises
    ------
    InputError
        If the text is not one SELECT statement, or names what does not exist.
    DatabaseError
        If a part that it reads is damaged.
    """
    with _told("query"):
        return _selection(connection, text).to_arrow_table()


def stream(connection: duckdb.DuckDBPyConnection, text: str, rows: int) -> pa.RecordBatchReader:
    """The result of one SELECT statement in batches, as they are computed; the connection serves nothing else then.

    Raises
    ------
    InputError, DatabaseError
        As :func:`select`; damage is told when the reader comes to it.
    """
    with _told("query"):
        return _batches(connection, _selection(connection, text), rows, "query")


def choose(
    connection: duckdb.DuckDBPyConnection, view: str, where: str | None, *, order: str | None = None
) -> pa.Table:
    """All rows of a view that meet a condition.

    Parameters
    ----------
    where
        One SQL expression, parsed as such: no text can end it and begin something else. It may hold subqueries over
        the views of the connection. None stands for all rows.
    order
        Column to sort by.

    Raises
    ------
    InputError
        If ``where`` is not one expression, or names what does not exist; the message repeats it.
    DatabaseError
        If a part is damaged.
    """
    with _told(_owner(where)):
        found = _chosen(connection, view, where)
        return (found.order(order) if order else found).to_arrow_table()


def choose_batches(
    connection: duckdb.DuckDBPyConnection, view: str, where: str | None, columns: Sequence[str], rows: int
) -> pa.RecordBatchReader:
    """Rows of a view that meet a condition, in batches in the view's order; see :func:`choose` and :func:`stream`."""
    with _told(_owner(where)):
        found = _chosen(connection, view, where).project(", ".join(f'"{name}"' for name in columns))
        return _batches(connection, found, rows, _owner(where))


def _selection(connection: duckdb.DuckDBPyConnection, text: str) -> duckdb.DuckDBPyRelation:
    statements = connection.extract_statements(text)
    if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
        raise InputError(f"query {text!r} must be one SELECT statement; a database is read-only")
    return connection.sql(text)


def _chosen(connection: duckdb.DuckDBPyConnection, view: str, where: str | None) -> duckdb.DuckDBPyRelation:
    relation = connection.view(view)
    return relation if where is None else relation.filter(duckdb.SQLExpression(where))


def _owner(where: str | None) -> str:
    if where is not None and (not isinstance(where, str) or not where.strip()):
        raise InputError(
            f"where = {where!r} must be a condition in SQL, for example 'tooth = 6'; leave it out for all rows"
        )
    return "query" if where is None else f"query: where = {where!r}"


def _batches(
    connection: duckdb.DuckDBPyConnection, relation: duckdb.DuckDBPyRelation, rows: int, owner: str
) -> pa.RecordBatchReader:
    reader = relation.to_arrow_reader(rows)

    def read() -> Iterator[pa.RecordBatch]:
        try:
            with _told(owner):
                yield from reader
        finally:
            connection.close()

    return pa.RecordBatchReader.from_batches(reader.schema, read())


@contextmanager
def _told(owner: str) -> Iterator[None]:
    """Tell what is wrong with the question, or with the database, in a sentence."""
    try:
        yield
    except duckdb.Error as error:
        if "reading the stream" in str(error):
            raise DatabaseError(_damage(error)) from None
        raise InputError(f"{owner}: {_first_line(error)}") from None
    except (OSError, pa.ArrowInvalid) as error:
        raise DatabaseError(_damage(error)) from None


def _damage(error: Exception) -> str:
    """The sentence of the file that is damaged, out of what Arrow and DuckDB have put around it."""
    line = _first_line(error).rpartition("IOError: ")[2].partition(". Detail: Python exception")[0]
    return line if " is damaged: " in line else f"a part of the database is damaged: {line}"


def _first_line(error: Exception) -> str:
    lines = [line for line in str(error).splitlines() if line.strip()]
    hints = [line for line in lines if line.startswith(("Candidate", "Did you mean"))]
    return "; ".join([lines[0], *hints])


SignalRows = Callable[[IntArray], Iterable[tuple[IntArray, pa.Table]]]
"""Rows of ``signals`` by ids in ascending order, block by block."""


def chosen_columns(schema: pa.Schema, table: str, columns: Sequence[str] | None) -> list[str]:
    """The columns to read, all if None.

    Raises
    ------
    InputError
        If the table has no such column.
    """
    if columns is None:
        return list(schema.names)
    for name in columns:
        if name not in schema.names:
            raise InputError(f"columns: {table} has no column {name!r}{suggestion(name, schema.names)}")
    return list(columns)


def check_table(table: str) -> None:
    """Refuse a table that no database has."""
    if table not in TABLES:
        raise InputError(f"table = {table!r} is not a table of a database{suggestion(table, TABLES)}")


def check_rows(rows: int) -> None:
    """Refuse batches without rows."""
    if rows < 1:
        raise InputError(f"rows = {rows} must be 1 or more: it is the greatest number of rows in a batch")


def describe_columns(reader: pa.RecordBatchReader, schema: pa.Schema) -> pa.RecordBatchReader:
    """Batches whose columns carry unit, description and formula, which SQL forgets."""
    wanted = pa.schema([schema.field(name) for name in reader.schema.names])
    return pa.RecordBatchReader.from_batches(wanted, (batch.cast(wanted) for batch in reader))


def signal_batches(
    ids: pa.RecordBatchReader, read: SignalRows, columns: Sequence[str], schema: pa.Schema
) -> pa.RecordBatchReader:
    """Rows of ``signals`` of a stream of ids, a batch for each batch of ids."""
    wanted = pa.schema([schema.field(name) for name in columns])

    def batches() -> Iterator[pa.RecordBatch]:
        for batch in ids:
            blocks = [rows.select(columns) for _, rows in read(batch["id"].to_numpy())]
            yield from pa.concat_tables(blocks).cast(wanted).combine_chunks().to_batches()

    return pa.RecordBatchReader.from_batches(wanted, batches())
