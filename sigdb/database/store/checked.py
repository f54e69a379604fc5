"""Files whose every block is compared with its checksum when it is read.

Parquet has checksums of its pages' data, but not of their headers and of the footer. A flipped bit there can change
numbers silently, and not every reader compares the checksums. So a receipt keeps the CRC-32 of every block of its
files, and every read compares it.
"""

import base64
import io
import zlib
from copy import copy

import numpy as np
import pyarrow as pa

from sigdb.core import DatabaseError
from sigdb.database.store.receipts import FileRecord, repair
from sigdb.database.store.store import DamagedFileError, Store

BLOCK = 256 * 1024
"""Bytes in a block: a thousandth of a part, and a fraction of a millisecond to check."""


def block_checksums(content: memoryview) -> str:
    """Return the CRC-32 of each block of a file, little-endian, in base64."""
    sums = [zlib.crc32(content[start : start + BLOCK]) for start in range(0, len(content), BLOCK)]
    return base64.b64encode(np.array(sums, dtype="<u4").tobytes()).decode()


def open_checked(store: Store, record: FileRecord, errors: list[DatabaseError] | None = None) -> pa.NativeFile:
    """Open a file of a part for Arrow. It is opened for each read, so it may be kept for long.

    Parameters
    ----------
    store
        Where the database lies.
    record
        The file, as its receipt describes it.
    errors
        A list to which errors of reading are added, since DuckDB passes them on as text.

    Raises
    ------
    DamagedFileError
        While reading, if a block that is read is not as it was written.
    FileError
        While reading, if the file cannot be read.
    """
    return pa.PythonFile(_CheckedFile(store, record, [] if errors is None else errors), mode="r")


class _CheckedFile(io.RawIOBase):
    def __init__(self, store: Store, record: FileRecord, errors: list[DatabaseError]) -> None:
        self._store, self._record, self._errors = store, record, errors
        self._sums = np.frombuffer(base64.b64decode(record.blocks), dtype="<u4")
        self._position = 0

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
        try:
            return self._read(size)
        except DatabaseError as error:
            self._errors.append(copy(error))  # without the traceback, which holds all that is in use
            raise

    def _read(self, size: int) -> bytes:
        stop = self._record.bytes if size < 0 else min(self._position + size, self._record.bytes)
        start, self._position = self._position, stop
        if start >= stop:
            return b""
        first, last = start // BLOCK, -(-stop // BLOCK)
        content = memoryview(self._store.get_range(self._record.path, first * BLOCK, (last - first) * BLOCK))
        for block in range(first, last):
            within = (block - first) * BLOCK
            if zlib.crc32(content[within : within + BLOCK]) != self._sums[block]:
                last_byte = min((block + 1) * BLOCK, self._record.bytes) - 1
                raise DamagedFileError(
                    self._store.name_of(self._record.path),
                    f"is damaged: bytes {block * BLOCK} to {last_byte} are not as they were written",
                    repair(self._store),
                )
        return bytes(content[start - first * BLOCK : stop - first * BLOCK])
