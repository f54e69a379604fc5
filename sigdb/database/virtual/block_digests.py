"""Digests of virtual rows: a checksum and a size of each column of each noise block, by which a reader compares.

The checksum is of the bits. Another kind of processor may round sums in another order; then the sums of absolute values
agree to a few rounding errors, and those of other rows do not.
"""

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sigdb.database.store.checked import CheckedParquet
from sigdb.database.store.receipts import DIGEST_SCHEMA

_SAME_SIZE = 1e-5
"""Greatest relative difference of two sums of the same rows on different processors (assumed).

It is a hundred rounding errors of a number in single precision. Sums of other noise differ by more than 1e-4.
"""


@dataclass(frozen=True)
class ColumnDigest:
    """Digest of a column of a noise block.

    Attributes
    ----------
    checksum
        CRC-32 of which rows have a value, the lengths of lists, and the values.
    size
        Sum of the absolute values; 0 for text.
    """

    checksum: int
    size: float

    @classmethod
    def of(cls, column: pa.Array | pa.ChunkedArray) -> "ColumnDigest":
        """Return the digest of a column."""
        whole = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
        checksum = zlib.crc32(whole.is_valid().to_numpy(zero_copy_only=False).tobytes())
        if pa.types.is_list(whole.type):
            lengths = pc.fill_null(pc.list_value_length(whole), 0).to_numpy()
            checksum, whole = zlib.crc32(lengths.tobytes(), checksum), whole.flatten()
        if pa.types.is_string(whole.type):
            return cls(zlib.crc32("\0".join(text or "" for text in whole.to_pylist()).encode(), checksum), 0.0)
        filled = pc.fill_null(whole, False if pa.types.is_boolean(whole.type) else 0)
        values = filled.to_numpy(zero_copy_only=False)
        size = np.abs(values.astype(np.float64)).sum()
        return cls(zlib.crc32(np.ascontiguousarray(values).tobytes(), checksum), float(size))

    def is_near(self, other: "ColumnDigest") -> bool:
        """Whether another digest may be that of the same rows, made on another processor."""
        return self.size > 0 and abs(self.size - other.size) <= _SAME_SIZE * self.size


def block_digests(tables: Mapping[str, pa.Table], first: int) -> pa.Table:
    """Return the digests of all columns of a noise block, as a table with the columns of :data:`DIGEST_SCHEMA`.

    Parameters
    ----------
    tables
        The block of each table.
    first
        Its first id.
    """
    columns = {name: column for table in tables.values() for name, column in _columns(table)}
    digests = [ColumnDigest.of(column) for column in columns.values()]
    return pa.table(
        [
            np.full(len(digests), first),
            list(columns),
            np.array([digest.checksum for digest in digests], np.uint32),
            [digest.size for digest in digests],
        ],
        schema=DIGEST_SCHEMA,
    )


def _columns(table: pa.Table) -> Iterator[tuple[str, pa.ChunkedArray]]:
    return zip(table.column_names, table.columns, strict=True)


class StoredDigests:
    """The digests of a part, which are read when they are first needed.

    Parameters
    ----------
    file
        The file of the part's digests.
    """

    def __init__(self, file: CheckedParquet) -> None:
        self._file = file
        self._digests: dict[tuple[int, str], ColumnDigest] | None = None

    def __getitem__(self, place: tuple[int, str]) -> ColumnDigest:
        """Return the digest of a column of the block with a first id."""
        return self._read()[place]

    def blocks(self) -> dict[int, set[str]]:
        """Return the names of the columns of each block, by its first id."""
        blocks: dict[int, set[str]] = {}
        for first, column in self._read():
            blocks.setdefault(first, set()).add(column)
        return blocks

    def _read(self) -> dict[tuple[int, str], ColumnDigest]:
        if self._digests is None:
            table = self._file.read()
            values = (table[name].to_pylist() for name in DIGEST_SCHEMA.names)
            self._digests = {(first, name): ColumnDigest(*each) for first, name, *each in zip(*values, strict=True)}
        return self._digests


def differing_columns(table: pa.Table, first: int, digests: StoredDigests) -> tuple[list[str], list[str]]:
    """Return the columns of a noise block whose digests differ: in the last bits only, and in more.

    Parameters
    ----------
    table
        Some columns of the block.
    first
        Its first id.
    digests
        The digests of its part.

    Raises
    ------
    KeyError
        If the part has no digest of a column.
    """
    near: list[str] = []
    other: list[str] = []
    for name, column in _columns(table):
        digest, stored = ColumnDigest.of(column), digests[first, name]
        if digest.checksum != stored.checksum:
            (near if stored.is_near(digest) else other).append(name)
    return near, other
