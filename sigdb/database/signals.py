"""Signals of rows, found by arithmetic on their ids: an id's part and row group are two divisions."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.database.store.writer import ROW_GROUP

ReadGroups = Callable[[int, list[int]], pa.Table]
"""Rows of some row groups of a part: called with the number of the part and of the groups within it."""

_GROUPS_AT_ONCE = 32


class AbsentRowError(InputError):
    """An id that no finished part holds."""

    def __init__(self, id: int) -> None:
        super().__init__(f"id {id} is not in the database")
        self.id = id


def row_blocks(read: ReadGroups, part_rows: int, ids: IntArray) -> Iterator[tuple[IntArray, pa.Table]]:
    """Rows by id, a few row groups at a time, so that memory stays bounded.

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
        Places in ``ids``, and the table's rows for them, in that order.

    Raises
    ------
    AbsentRowError
        If an id is not there.
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


def row_matrices(
    blocks: Iterable[tuple[IntArray, pa.Table]], columns: Mapping[str, str], rows: int
) -> dict[str, FloatArray]:
    """List columns as matrices (rows, n), nan where a row has no list.

    Parameters
    ----------
    blocks
        As :func:`row_blocks` gives them.
    columns
        Column of the table by key of the result.

    Returns
    -------
    dict
        Empty if no row has a list.

    Raises
    ------
    InputError
        If the rows have different lengths.
    """
    found: dict[str, FloatArray] = {}
    for places, table in blocks:
        for key, column in columns.items():
            lengths = {int(one) for one in list_lengths(table[column])} - {0}
            lengths |= {found[key].shape[1]} if key in found else set()
            if len(lengths) > 1:
                raise InputError(
                    f"rows have signals of different lengths {sorted(lengths)}; ask for one tooth count at a time"
                )
            for n in lengths:
                if key not in found:
                    found[key] = np.full((rows, n), np.nan, np.float32)
                found[key][places] = list_matrix(table[column], n)
    return found


def list_matrix(column: pa.ChunkedArray | pa.Array, width: int | None = None) -> FloatArray:
    """A list column as a matrix (rows, longest), float32; nan where a list is shorter or missing.

    Parameters
    ----------
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
    """Length of each list, 0 where there is none."""
    return np.asarray(pc.fill_null(pc.list_value_length(column), 0).to_numpy())
