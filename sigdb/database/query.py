"""SQL over a database: DuckDB on Arrow datasets, read-only and closed to everything outside."""

from collections.abc import Mapping

import duckdb
import pyarrow as pa
import pyarrow.dataset as ds

from sigdb.core.errors import DatabaseError, InputError


def connect(views: Mapping[str, ds.Dataset], selections: Mapping[str, str]) -> duckdb.DuckDBPyConnection:
    """A connection that sees the views and nothing else.

    The datasets check page checksums, which DuckDB's own Parquet reader does not.

    Parameters
    ----------
    views
        Dataset by view name.
    selections
        SQL text of further views by name.
    """
    connection = duckdb.connect(":memory:")
    for name, dataset in views.items():
        connection.register(name, dataset)
    for name, text in selections.items():
        connection.execute(f"create view {name} as {text}")
    for setting in ("python_enable_replacements=false", "enable_external_access=false", "lock_configuration=true"):
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
    try:
        statements = connection.extract_statements(text)
        if len(statements) != 1 or statements[0].type != duckdb.StatementType.SELECT:
            raise InputError(f"query {text!r} must be one SELECT statement; a database is read-only")
        return connection.sql(text).to_arrow_table()
    except duckdb.Error as error:
        if "reading the stream" in str(error):
            raise DatabaseError(f"a part of the database is damaged: {_first_line(error)}") from None
        raise InputError(f"query: {_first_line(error)}") from None


def _first_line(error: Exception) -> str:
    lines = [line for line in str(error).splitlines() if line.strip()]
    hints = [line for line in lines if line.startswith(("Candidate", "Did you mean"))]
    return "; ".join([lines[0], *hints])
