"""Writer of parts: Parquet files first, which are checked, then the receipt."""

import hashlib
import platform
import socket
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sigdb.core import DatabaseError, __version__, blocks
from sigdb.database.store.checked import block_checksums
from sigdb.database.store.plain_lists import PLAIN_GROUP, lists_of_group, plain_runs
from sigdb.database.store.receipts import (
    BLOCK,
    SMALL_BLOCK,
    FileRecord,
    PlainRuns,
    Receipt,
    part_name,
    revision_of,
    write_receipt,
)
from sigdb.database.store.store import Store

ROW_GROUP = {"templates": 16, "features": 32768, "signals": PLAIN_GROUP}
"""Rows in a row group: small ones for look-ups of signals, large ones for scans of features."""

_WHOLE_GROUP = 1 << 30
"""Bytes that a page may have, so that a row group is one page."""


def write_part(
    store: Store,
    name: str,
    part: int,
    pieces: Iterable[Mapping[str, pa.Table]],
    *,
    plan: str,
    first: int,
    started: float,
    status: str = "status",
    source: str = "",
    stored: Callable[[Mapping[str, pa.Table]], Mapping[str, pa.Table]] = dict,
) -> Receipt:
    """Write the files of a part and then its receipt.

    Parameters
    ----------
    store
        Where the database lies.
    name
        Kind of the part: ``templates``, ``rows``, or ``added.`` and the name of a set of added features.
    part
        Number of the part.
    pieces
        The rows of the part in order, piece by piece: Arrow table by table name (``templates``, or ``features`` and
        ``signals``, or that of added features). Each piece is encoded when it comes, so that memory never holds all
        arrays of a part.
    plan
        Hash of the plan.
    first
        First id.
    started
        :func:`time.perf_counter` at the start of the work.
    status
        Column that is ``ok`` in rows with a result; the table that has it counts the rows.
    source
        As in :class:`Receipt`.
    stored
        Returns what is written of a piece; all of it by default.
    """
    encoders: dict[str, _Encoder] = {}
    rows = failed = 0
    for piece in pieces:
        for content in piece.values():
            if status in content.column_names:
                rows += content.num_rows
                failed += pc.sum(pc.not_equal(content[status], "ok")).as_py()
        for table, content in stored(piece).items():
            if table not in encoders:
                encoders[table] = _Encoder(table, content.schema)
            encoders[table].add(content)
    files = tuple(_write_file(store, part_name(table, part), encoder) for table, encoder in encoders.items())
    receipt = Receipt(
        name=name,
        part=part,
        plan=plan,
        first=first,
        rows=rows,
        failed=failed,
        files=files,
        host=socket.gethostname(),
        seconds=round(time.perf_counter() - started, 3),
        versions={"sigdb": __version__, "python": platform.python_version(), "pyarrow": pa.__version__},
        source=source,
    )
    write_receipt(store, receipt)
    return receipt


def write_again(store: Store, receipt: Receipt, table: str, content: pa.Table) -> Receipt:
    """Write the file of a table of a part again, with as many rows, and the part's receipt.

    The new file has a name of its own and the receipt names it, so that at every instant the part is whole, with the
    old rows or with the new ones. The old file is deleted last.
    """
    old = receipt.file(table)
    encoder = _Encoder(table, content.schema)
    encoder.add(content)
    new = _write_file(store, part_name(table, receipt.part, revision_of(old.path) + 1), encoder)
    receipt = replace(receipt, files=tuple(new if file is old else file for file in receipt.files))
    write_receipt(store, receipt)
    store.delete(old.path)
    return receipt


def _write_file(store: Store, name: str, encoder: "_Encoder") -> FileRecord:
    encoded = memoryview(encoder.encoded(name))
    store.put(name, encoded)
    block = SMALL_BLOCK if encoder.is_plain else BLOCK
    return FileRecord(
        path=name,
        bytes=len(encoded),
        sha256=hashlib.sha256(encoded).hexdigest(),
        blocks=block_checksums(encoded, block),
        block=block,
        plain=encoder.plain_runs(encoded) if encoder.is_plain else {},
    )


class _Encoder:
    """A table as a Parquet file in memory, encoded a row group at a time.

    Signals, whose rows are read one by one, are stored plainly, a page for each row group.
    """

    def __init__(self, table: str, schema: pa.Schema) -> None:
        floats, strings = _leaves(schema)
        self.is_plain = table == "signals"
        self._group, self._rows = ROW_GROUP.get(table, ROW_GROUP["features"]), 0
        self._lists: dict[str, list[tuple[int, str]]] = {
            field.name: [] for field in schema if pa.types.is_list(field.type)
        }
        """Length of the lists of each row group, and which rows lack one."""
        self._waiting: list[pa.Table] = []
        self._sink = pa.BufferOutputStream()
        self._writer = pq.ParquetWriter(
            self._sink,
            schema,
            compression="none" if self.is_plain else "zstd",
            compression_level=None if self.is_plain else 1,
            use_byte_stream_split=False if self.is_plain else floats,
            use_dictionary=strings,
            data_page_size=_WHOLE_GROUP if self.is_plain else None,
            write_statistics=["id"] if self.is_plain else True,
            write_page_checksum=True,
        )

    def add(self, rows: pa.Table) -> None:
        """Add the next rows: a divisor or a multiple of a row group, except for the last ones."""
        self._rows += rows.num_rows
        self._waiting.append(rows)
        if sum(some.num_rows for some in self._waiting) >= self._group:
            self._encode()

    def _encode(self) -> None:
        if not self._waiting:
            return
        rows = pa.concat_tables(self._waiting)
        self._writer.write_table(rows, row_group_size=self._group)
        self._waiting.clear()
        for name, lists in self._lists.items() if self.is_plain else ():
            lengths = pc.fill_null(pc.list_value_length(rows[name]), 0).to_numpy()
            lists += [lists_of_group(lengths[some]) for some in blocks(lengths.size, self._group)]

    def plain_runs(self, encoded: memoryview) -> dict[str, PlainRuns]:
        """Return where the numbers of each column of lists lie in the file."""
        return plain_runs(pq.ParquetFile(pa.BufferReader(pa.py_buffer(encoded))).metadata, self._lists)

    def encoded(self, name: str) -> pa.Buffer:
        """Return the file, after it has been opened again as a check."""
        self._encode()
        self._writer.close()
        encoded = self._sink.getvalue()
        written = pq.ParquetFile(pa.BufferReader(encoded)).metadata.num_rows
        if written != self._rows:
            raise DatabaseError(f"{name}: {written} rows were written of {self._rows}; run the sweep again")
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
