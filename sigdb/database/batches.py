"""Tables of a database in batches, so that a database larger than memory can be read."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import pyarrow as pa

from sigdb.core.errors import InputError, suggestion
from sigdb.core.typing import IntArray
from sigdb.database.schema import TABLES

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


def described(reader: pa.RecordBatchReader, schema: pa.Schema) -> pa.RecordBatchReader:
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
