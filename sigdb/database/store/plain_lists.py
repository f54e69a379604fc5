"""Lists of numbers that a file holds plainly: read by place, without decoding what lies around them."""

import io
import zlib
from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow.parquet as pq

from sigdb.core import FloatArray, IntArray
from sigdb.database.store.checked import block_sums, damaged_block
from sigdb.database.store.receipts import FileRecord, PlainRuns
from sigdb.database.store.store import Store

PLAIN_GROUP = 256
"""Rows in a row group of such a file, but for its last one."""


def plain_runs(metadata: pq.FileMetaData, lengths: Mapping[str, Sequence[int]]) -> dict[str, PlainRuns]:
    """Return where the numbers of columns of lists lie in a file: at the end of the chunk of each row group.

    Parameters
    ----------
    metadata
        Footer of the file.
    lengths
        By column, the length of every list of each row group; 0 where they differ or lack.
    """
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    places = {metadata.schema.column(place).path.partition(".list")[0]: place for place in range(metadata.num_columns)}
    return {
        name: tuple(_run(group, places[name], length) for group, length in zip(groups, lengths[name], strict=True))
        for name in lengths
    }


def _run(group: pq.RowGroupMetaData, place: int, length: int) -> tuple[int, int]:
    chunk = group.column(place)
    if not length or chunk.num_values != group.num_rows * length:
        return 0, 0
    return chunk.data_page_offset + chunk.total_compressed_size - 4 * chunk.num_values, length


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
        self._runs = {name: np.array(runs, np.int64).reshape(-1, 2) for name, runs in record.plain.items()}
        self._sums = block_sums(record)
        self._whole = np.zeros(self._sums.size, bool)
        """Blocks that were compared."""

    def lengths(self, column: str, rows: IntArray) -> IntArray:
        """Return the length of the lists of rows, by place in the file; 0 where they are not stored so."""
        if column not in self._runs:
            return np.zeros(rows.size, np.int64)
        lengths: IntArray = self._runs[column][rows // PLAIN_GROUP, 1]
        return lengths

    def read(self, column: str, rows: IntArray, length: int) -> FloatArray:
        """Return the lists of rows, (rows, length), float32.

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
        groups, within = np.divmod(rows, PLAIN_GROUP)
        first, size = self._runs[column][groups, 0] + 4 * length * within, 4 * length
        lists = np.empty((rows.size, length), "<f4")
        content = lists.data.cast("B")
        with self._store.opened_here(self._record.path) as file:
            self._compare(file, self._blocks(first // self._record.block, (first + size - 1) // self._record.block))
            edges = np.flatnonzero(np.diff(first, prepend=-size, append=-size) != size)
            for start, stop, at in zip(
                edges[:-1].tolist(), edges[1:].tolist(), first[edges[:-1]].tolist(), strict=True
            ):
                _fill(file, at, content[start * size : stop * size])
        return lists.astype(np.float32, copy=False)

    def _blocks(self, first: IntArray, last: IntArray) -> IntArray:
        """Return the numbers of the blocks that lie in some ranges."""
        begun = np.bincount(first, minlength=self._sums.size + 1) - np.bincount(last + 1, minlength=self._sums.size + 1)
        return np.flatnonzero(np.cumsum(begun))

    def _compare(self, file: io.FileIO, numbers: IntArray) -> None:
        """Compare blocks with their checksums, but for those that were compared before."""
        new, size = numbers[~self._whole[numbers]], self._record.block
        content = memoryview(bytearray(size))
        for number in new.tolist():
            block = content[: self._record.bytes - number * size]
            _fill(file, number * size, block)
            if zlib.crc32(block) != self._sums[number]:
                raise damaged_block(self._store, self._record, number)
        self._whole[new] = True


def _fill(file: io.FileIO, first: int, content: memoryview) -> None:
    file.seek(first)
    if file.readinto(content) != len(content):
        raise OSError("the file ends too early")
