"""Signals of rows by id: two divisions locate the part and the row group of an id."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sigdb.core import FloatArray, InputError, IntArray, blocks
from sigdb.database.store.plain_lists import PlainLists
from sigdb.database.store.writer import ROW_GROUP

ReadGroups = Callable[[int, list[int]], pa.Table]
"""Returns the rows of some row groups: called with the number of a part and the numbers of the groups within it."""

_GROUPS_AT_ONCE = 32
"""Row groups that are read together."""


_ROWS_AT_ONCE = 1024
"""Rows without compression that are read together: they stay in a cache of the processor."""


class AbsentRowError(InputError):
    """An id that no finished part holds.

    Parameters
    ----------
    id
        The id.
    """

    def __init__(self, id: int) -> None:
        super().__init__(f"id {id} is not in the database")
        self.id = id


def row_blocks(read: ReadGroups, part_rows: int, ids: IntArray) -> Iterator[tuple[IntArray, pa.Table]]:
    """Yield rows by id, a few row groups at a time, so that memory is bounded.

    Parameters
    ----------
    read
        Reads row groups of a part.
    part_rows
        Rows in a part.
    ids
        (k,) ids, in any order, also repeated.

    Yields
    ------
    places, rows
        Places in ``ids``, and the rows of the table for them, in that order.

    Raises
    ------
    AbsentRowError
        If no row has an id.
    """
    group_rows = ROW_GROUP["signals"]
    part_groups = part_rows // group_rows
    order = np.argsort(ids, kind="stable")
    if order.size and ids[order[0]] < 0:
        raise AbsentRowError(int(ids[order[0]]))
    block = ids[order] // (group_rows * math.gcd(_GROUPS_AT_ONCE, part_groups))
    for places in np.split(order, np.flatnonzero(np.diff(block)) + 1):
        if places.size:
            groups = np.unique(ids[places] // group_rows)
            table = read(int(groups[0]) // part_groups, (groups % part_groups).tolist())
            yield places, _rows(table, ids[places])


def _rows(table: pa.Table, ids: IntArray) -> pa.Table:
    stored = table["id"].to_numpy()
    at = np.searchsorted(stored, ids)
    absent = ids[~np.isin(ids, stored)]
    if absent.size:
        raise AbsentRowError(int(absent[0]))
    if at.size == stored.size and at[0] == 0 and (np.diff(at) == 1).all():
        return table
    return table.combine_chunks().take(at)


Lists = Mapping[str, FloatArray]
"""Lists of rows as matrices (rows, n) by key, nan where a row has none; n is 0 if no row has one."""


def decoded_lists(rows: pa.Table, columns: Mapping[str, str]) -> Lists:
    """Return list columns of rows.

    Parameters
    ----------
    rows
        Rows of the table.
    columns
        Column of the table by key of the result.

    Raises
    ------
    InputError
        If the rows have different lengths.
    """
    for column in columns.values():
        _check_one_length({int(length) for length in list_lengths(rows[column])} - {0})
    return {key: list_matrix(rows[column]) for key, column in columns.items()}


def plain_lists(
    file: PlainLists, columns: Mapping[str, str], places: IntArray, rows: IntArray
) -> Iterator[tuple[IntArray, Lists]]:
    """Yield the rows of a file that are stored plainly, by the length of their lists.

    Parameters
    ----------
    file
        The file.
    columns
        Column of the table by key of the result.
    places
        (k,) places of the rows in the result.
    rows
        (k,) places of the rows in the file, ascending.
    """
    lengths = np.stack([file.lengths(column, rows) for column in columns.values()])
    for each in np.unique(lengths, axis=1).T:
        here = (lengths == each[:, None]).all(axis=0)
        if each.all():  # in the others lists differ within a row group, or all lack
            sizes = dict(zip(columns.items(), each.tolist(), strict=True))
            for some in blocks(int(here.sum()), _ROWS_AT_ONCE):
                wanted = rows[here][some]
                yield places[here][some], {key: file.read(name, wanted, n) for (key, name), n in sizes.items()}


def row_matrices(blocks: Iterable[tuple[IntArray, Lists]], rows: int) -> dict[str, FloatArray]:
    """Return lists of rows as matrices (rows, n), nan where a row has no list.

    Parameters
    ----------
    blocks
        Places of rows in the result, and their lists.
    rows
        Number of rows of the result.

    Returns
    -------
    dict
        Empty if no row has a list.

    Raises
    ------
    InputError
        If the rows have different lengths.
    """
    matrices: dict[str, FloatArray] = {}
    for places, lists in blocks:
        for key, values in lists.items():
            if not values.shape[1]:
                continue
            if key not in matrices:
                matrices[key] = np.full((rows, values.shape[1]), np.nan, np.float32)
            _check_one_length({values.shape[1], matrices[key].shape[1]})
            matrices[key][places] = values
    return matrices


def _check_one_length(lengths: set[int]) -> None:
    if len(lengths) > 1:
        raise InputError(f"rows have signals of different lengths {sorted(lengths)}; select rows of one tooth count")


def list_matrix(column: pa.ChunkedArray | pa.Array, width: int | None = None) -> FloatArray:
    """Return a list column as a matrix (rows, width), float32; nan where a list is shorter or missing.

    Parameters
    ----------
    column
        The column.
    width
        Columns of the matrix; the longest list's length if left out.
    """
    column = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    lengths = list_lengths(column)
    width = int(lengths.max(initial=0)) if width is None else width
    values = column.flatten().to_numpy(zero_copy_only=False)
    if (lengths == width).all():
        return np.asarray(values, dtype=np.float32).reshape(len(column), width)
    matrix = np.full((len(column), width), np.nan, dtype=np.float32)
    matrix[np.arange(width) < lengths[:, None]] = values
    return matrix


def list_lengths(column: pa.ChunkedArray | pa.Array) -> IntArray:
    """Return the length of each list, 0 where there is none."""
    return np.asarray(pc.fill_null(pc.list_value_length(column), 0).to_numpy())
