"""Lists of numbers that a file holds plainly: read by place, without decoding what lies around them."""

import io
import itertools
import os
import zlib
from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow.parquet as pq

from sigdb.core import FloatArray, IntArray, blocks
from sigdb.database.store.checked import block_sums, damaged_block
from sigdb.database.store.receipts import FileRecord, PlainRuns
from sigdb.database.store.store import Store

PLAIN_GROUP = 256
"""Rows in a row group of such a file, but for its last one."""


def lists_of_group(lengths: IntArray) -> tuple[int, str]:
    """Return the length of the lists of a row group and which rows lack one, as :data:`PlainRuns` has them.

    Parameters
    ----------
    lengths
        Length of the list of each row, 0 where there is none.

    Examples
    --------
    >>> import numpy as np
    >>> lists_of_group(np.array([5, 0, 5, 5, 0])), lists_of_group(np.array([5, 4]))
    ((5, '12'), (0, ''))
    """
    present = np.unique(lengths[lengths > 0])
    if present.size != 1:
        return 0, ""
    missing = sum(1 << row for row in np.flatnonzero(lengths == 0).tolist())
    return int(present[0]), f"{missing:x}" if missing else ""


def plain_runs(metadata: pq.FileMetaData, lists: Mapping[str, Sequence[tuple[int, str]]]) -> dict[str, PlainRuns]:
    """Return where the numbers of columns of lists lie in a file: at the end of the chunk of each row group.

    Parameters
    ----------
    metadata
        Footer of the file.
    lists
        By column, the length of the lists of each row group and which rows lack one; see :func:`lists_of_group`.
    """
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    places = {metadata.schema.column(place).path.partition(".list")[0]: place for place in range(metadata.num_columns)}
    return {
        name: tuple(_run(group, places[name], *each) for group, each in zip(groups, lists[name], strict=True))
        for name in lists
    }


def _run(group: pq.RowGroupMetaData, place: int, length: int, missing: str) -> tuple[int, int, str]:
    chunk, lacking = group.column(place), int(missing or "0", 16).bit_count()
    values = (group.num_rows - lacking) * length
    if not length or chunk.num_values != values + lacking:
        return 0, 0, ""
    return chunk.data_page_offset + chunk.total_compressed_size - 4 * values, length, missing


_BYTES_AT_ONCE = 1024 * 1024
"""Bytes of blocks that are compared together; a whole number of blocks."""


_WILL_NEED = getattr(os, "POSIX_FADV_WILLNEED", 0)


class _Groups:
    """Row groups of a column: length of their lists, and where each begins."""

    def __init__(self, runs: PlainRuns) -> None:
        self._first = np.array([first for first, _, _ in runs], np.int64)
        self.length: IntArray = np.array([length for _, length, _ in runs], np.int64)
        self._missing = np.zeros((len(runs), PLAIN_GROUP), bool)
        for group, (_, _, missing) in enumerate(runs):
            bits = np.frombuffer(int(missing or "0", 16).to_bytes(PLAIN_GROUP // 8, "little"), np.uint8)
            self._missing[group] = np.unpackbits(bits, bitorder="little")
        self._before = np.cumsum(self._missing, axis=1)

    def first_bytes(self, rows: IntArray) -> tuple[IntArray, IntArray]:
        """Return which of some rows have a list, and the first byte of each such list."""
        group, within = np.divmod(rows, PLAIN_GROUP)
        present = np.flatnonzero(~self._missing[group, within])
        group, within = group[present], within[present]
        place = within - self._before[group, within]
        return present, self._first[group] + 4 * self.length[group] * place


class PlainLists:
    """Lists of a file of a directory that are stored without compression, one after another.

    A block of the file is compared with its checksum when it is read for the first time.

    Parameters
    ----------
    store
        A directory.
    record
        The file, as its receipt describes it.
    """

    def __init__(self, store: Store, record: FileRecord) -> None:
        self._store, self._record = store, record
        self._runs = {name: _Groups(runs) for name, runs in record.plain.items()}
        self._sums = block_sums(record)
        self._whole = np.zeros(self._sums.size, bool)
        """Blocks that were compared."""

    def lengths(self, column: str, rows: IntArray) -> IntArray:
        """Return the length of the lists about rows, by place in the file; 0 where they are not stored so."""
        if column not in self._runs:
            return np.zeros(rows.size, np.int64)
        return self._runs[column].length[rows // PLAIN_GROUP]

    def read(self, column: str, rows: IntArray, length: int) -> FloatArray:
        """Return the lists of rows, (rows, length), float32; nan where a row has none.

        Parameters
        ----------
        column
            Name of the column.
        rows
            (k,) places in the file, ascending.
        length
            The length of these lists.

        Raises
        ------
        DamagedFileError
            If a block that is read is not as it was written.
        FileError
            If the file cannot be read.
        """
        lists = np.full((rows.size, length), np.nan, "<f4")
        present, first = self._runs[column].first_bytes(rows)
        if not present.size:
            return lists.astype(np.float32, copy=False)
        size, content = 4 * length, lists.data.cast("B")
        with self._store.opened_here(self._record.path) as file:
            self._compare(file, self._blocks(first // self._record.block, (first + size - 1) // self._record.block))
            # Rows that lie together in the file and in the result are read together.
            together = (np.diff(first) == size) & (np.diff(present) == 1)
            edges = [0, *(np.flatnonzero(~together) + 1).tolist(), present.size]
            for start, stop in itertools.pairwise(edges):
                at = int(present[start]) * size
                _fill(file, int(first[start]), content[at : at + (stop - start) * size])
        return lists.astype(np.float32, copy=False)

    def _blocks(self, first: IntArray, last: IntArray) -> IntArray:
        """Return the numbers of the blocks that lie in some ranges."""
        begun = np.bincount(first, minlength=self._sums.size + 1) - np.bincount(last + 1, minlength=self._sums.size + 1)
        return np.flatnonzero(np.cumsum(begun))

    def _compare(self, file: io.FileIO, numbers: IntArray) -> None:
        """Compare blocks with their checksums, but for those that were compared before."""
        new, size = numbers[~self._whole[numbers]], self._record.block
        edges = np.flatnonzero(np.diff(new, prepend=-2, append=-2) != 1) if new.size else new
        stops = np.minimum((new[edges[1:] - 1] + 1) * size, self._record.bytes)
        runs = [*zip((new[edges[:-1]] * size).tolist(), stops.tolist(), strict=True)]
        _read_ahead(file, runs)
        for first, stop in runs:
            for some in blocks(stop - first, _BYTES_AT_ONCE):
                at, content = first + some.start, memoryview(bytearray(some.stop - some.start))
                _fill(file, at, content)
                for within in range(0, len(content), size):
                    number = (at + within) // size
                    if zlib.crc32(content[within : within + size]) != self._sums[number]:
                        raise damaged_block(self._store, self._record, number)
        self._whole[new] = True


def _read_ahead(file: io.FileIO, runs: Sequence[tuple[int, int]]) -> None:
    """Let the system read all runs of bytes at once, from a first byte to a last, where it offers that."""
    advise = getattr(os, "posix_fadvise", None)
    if advise is not None:
        for first, stop in runs:
            advise(file.fileno(), first, stop - first, _WILL_NEED)


def _fill(file: io.FileIO, first: int, content: memoryview) -> None:
    file.seek(first)
    if file.readinto(content) != len(content):
        raise OSError("the file ends too early")
