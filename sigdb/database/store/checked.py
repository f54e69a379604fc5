"""Files whose every block is compared with its checksum when it is read.

Parquet has checksums of its pages' data, but not of their headers and of the footer. A flipped bit there can change
numbers silently, and not every reader compares the checksums. So a receipt keeps the CRC-32 of every block of its
files, and every read compares it.
"""

import base64
import io
import zlib
from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.dataset as ds
import pyarrow.parquet as pq
from numpy.typing import NDArray

from sigdb.database.store.receipts import BLOCK, FileRecord, repair
from sigdb.database.store.store import DamagedFileError, Store


def block_checksums(content: memoryview, block: int = BLOCK) -> str:
    """Return the CRC-32 of each block of a file, little-endian, in base64."""
    sums = [zlib.crc32(content[start : start + block]) for start in range(0, len(content), block)]
    return base64.b64encode(np.array(sums, dtype="<u4").tobytes()).decode()


class PartTable(Protocol):
    """A table of a part: a file whose reads are compared with checksums, or rows that are made when they are read."""

    store: Store
    record: FileRecord

    @property
    def schema(self) -> pa.Schema:
        """Columns of the table."""

    @property
    def group_rows(self) -> list[int]:
        """Number of rows of each row group."""

    def read(self, groups: Sequence[int] | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """Return some row groups and columns; all of them if None."""

    def groups_that_may_meet(self, condition: pc.Expression, schema: pa.Schema | None = None) -> list[int]:
        """Return the row groups that may hold rows that meet a condition, on columns of a schema with others."""


class CheckedParquet:
    """A Parquet file of a part, whose reads are compared with its checksums.

    Each read opens the file, reads it in the calling thread and closes it. A thread of Arrow's pool that still read it
    while Python ends would abort the process.

    Parameters
    ----------
    store
        Where the database lies.
    record
        The file, as its receipt describes it.
    """

    def __init__(self, store: Store, record: FileRecord) -> None:
        self.store, self.record = store, record

    @property
    def schema(self) -> pa.Schema:
        """Columns of the file."""
        return self._footer[1]

    @property
    def group_rows(self) -> list[int]:
        """Number of rows of each row group."""
        metadata, _ = self._footer
        return [metadata.row_group(group).num_rows for group in range(metadata.num_row_groups)]

    @cached_property
    def _footer(self) -> tuple[pq.FileMetaData, pa.Schema]:
        with self._file() as source, pq.ParquetFile(source, pre_buffer=False) as file:
            return file.metadata, file.schema_arrow

    def read(self, groups: Sequence[int] | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """Return some row groups and columns; all of them if None.

        Raises
        ------
        DamagedFileError
            If a block that is read is not as it was written.
        FileError
            If the file cannot be read.
        """
        metadata, _ = self._footer
        wanted = None if columns is None else list(columns)
        some = range(metadata.num_row_groups) if groups is None else groups
        with self._file() as source, pq.ParquetFile(source, metadata=metadata, pre_buffer=False) as file:
            return file.read_row_groups(list(some), columns=wanted, use_threads=False)

    def groups_that_may_meet(self, condition: pc.Expression, schema: pa.Schema | None = None) -> list[int]:
        """Return the row groups whose statistics do not rule out a condition, on columns of a schema with others."""
        with self._file() as file:
            fragment = PARQUET.make_fragment(file).subset(filter=condition, schema=schema or self.schema)
            return [group.id for group in fragment.row_groups]

    def _file(self) -> pa.NativeFile:
        return pa.PythonFile(_CheckedFile(self.store, self.record), mode="r")


PARQUET = ds.ParquetFileFormat()


class _CheckedFile(io.RawIOBase):
    def __init__(self, store: Store, record: FileRecord) -> None:
        self._store, self._record = store, record
        self._sums, self._block = block_sums(record), record.block
        self._position = 0
        self._kept, self._kept_first, self._kept_last = memoryview(b""), 0, 0
        """The blocks that were read last."""

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._position

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: self._record.bytes}[whence]
        self._position = base + offset
        return self._position

    def read(self, size: int = -1) -> bytes:
        stop = self._record.bytes if size < 0 else min(self._position + size, self._record.bytes)
        start, self._position = self._position, stop
        if start >= stop:
            return b""
        first, last = start // self._block, -(-stop // self._block)
        # Columns of few values share blocks and are read one after another.
        if not self._kept_first <= first <= last <= self._kept_last:
            self._kept = self._checked(first, last)
            self._kept_first, self._kept_last = first, last
        offset = self._kept_first * self._block
        return bytes(self._kept[start - offset : stop - offset])

    def _checked(self, first: int, last: int) -> memoryview:
        """Return the content of blocks, compared with their checksums."""
        size = self._block
        content = memoryview(self._store.get_range(self._record.path, first * size, (last - first) * size))
        for block in range(first, last):
            within = (block - first) * size
            if zlib.crc32(content[within : within + size]) != self._sums[block]:
                raise damaged_block(self._store, self._record, block)
        return content


def block_sums(record: FileRecord) -> NDArray[np.uint32]:
    """Return the CRC-32 of each block of a file, by its record."""
    return np.frombuffer(base64.b64decode(record.blocks), dtype="<u4")


def damaged_block(store: Store, record: FileRecord, block: int) -> DamagedFileError:
    """Return the error of a block that is not as it was written."""
    first, last = block * record.block, min((block + 1) * record.block, record.bytes) - 1
    problem = f"is damaged: bytes {first} to {last} are not as they were written"
    return DamagedFileError(store.name_of(record.path), problem, repair(store))
