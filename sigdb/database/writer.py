"""Writing a part: Parquet files first, checked, then the receipt."""

import hashlib
import platform
import socket
import time
from collections.abc import Mapping

import pyarrow as pa
import pyarrow.parquet as pq

from sigdb.core.errors import DatabaseError
from sigdb.core.version import __version__
from sigdb.database.checked import block_checksums
from sigdb.database.receipts import FileRecord, Receipt, part_name, write_receipt
from sigdb.database.storage import Store

ROW_GROUP = {"templates": 16, "features": 32768, "signals": 256}
"""Rows in a row group: small ones for look-ups of signals, large ones for scans of features."""


def write_part(
    store: Store,
    name: str,
    part: int,
    tables: Mapping[str, pa.Table],
    *,
    plan: str,
    first: int,
    failed: int,
    started: float,
) -> Receipt:
    """Write the files of a part and then its receipt.

    Parameters
    ----------
    store
        Where the database lies.
    name
        ``templates`` or ``rows``.
    part
        Number of the part.
    tables
        Arrow table by table name (``templates``, or ``features`` and ``signals``).
    plan
        Hash of the plan.
    first, failed
        First id, and the number of rows without a result.
    started
        :func:`time.perf_counter` at the start of the work.
    """
    files = tuple(_write_table(store, table, part, content) for table, content in tables.items())
    receipt = Receipt(
        name=name,
        part=part,
        plan=plan,
        first=first,
        rows=next(iter(tables.values())).num_rows,
        failed=failed,
        files=files,
        host=socket.gethostname(),
        seconds=round(time.perf_counter() - started, 3),
        versions={"sigdb": __version__, "python": platform.python_version(), "pyarrow": pa.__version__},
    )
    write_receipt(store, receipt)
    return receipt


def _write_table(store: Store, table: str, part: int, content: pa.Table) -> FileRecord:
    name = part_name(table, part)
    encoded = memoryview(_parquet(name, table, content))
    store.put(name, encoded)
    return FileRecord(
        path=name,
        bytes=len(encoded),
        sha256=hashlib.sha256(encoded).hexdigest(),
        blocks=block_checksums(encoded),
    )


def _parquet(name: str, table: str, content: pa.Table) -> pa.Buffer:
    """A table as a Parquet file, opened once again to see that it is whole."""
    floats, strings = _leaves(content.schema)
    sink = pa.BufferOutputStream()
    pq.write_table(
        content,
        sink,
        row_group_size=ROW_GROUP[table],
        compression="zstd",
        compression_level=1,
        use_byte_stream_split=floats,
        use_dictionary=strings,
        write_statistics=["id"] if table == "signals" else True,
        write_page_checksum=True,
    )
    encoded = sink.getvalue()
    written = pq.ParquetFile(pa.BufferReader(encoded)).metadata
    if written.num_rows != content.num_rows:
        raise DatabaseError(f"{name}: {written.num_rows} rows were written of {content.num_rows}; run the sweep again")
    return encoded


def _leaves(schema: pa.Schema) -> tuple[list[str], list[str]]:
    """Parquet paths of the floating-point and of the text columns."""
    floats, strings = [], []
    for field in schema:
        if pa.types.is_floating(field.type):
            floats.append(field.name)
        elif pa.types.is_list(field.type):
            floats.append(f"{field.name}.list.element")
        elif pa.types.is_string(field.type):
            strings.append(field.name)
    return floats, strings
