"""An export as a MAT-file of version 5, which MATLAB, Octave and SciPy read. It is composed in memory."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sigdb.core import InputError
from sigdb.database.export.columns import ExportColumn, Values

LIMIT = 2**31 - 1
"""Bytes that a variable of a MAT-file of version 5 may have."""


def write_mat(
    path: Path, columns: Sequence[ExportColumn], batches: Iterable[Mapping[str, Values]], about: Mapping[str, str]
) -> int:
    """Write batches and return the number of rows.

    Variables: ``cases``, a struct of columns (rows, 1), text as cells; each list column, (rows, n) single; ``units``,
    ``descriptions`` and ``formulas``, structs with the columns' names; ``about``.
    """
    from scipy.io import savemat  # slow to load

    parts = list(batches)
    values = {column.name: _matlab(column, [part[column.name] for part in parts]) for column in columns}
    lists = [column.name for column in columns if column.is_list]
    cases = {name: value for name, value in values.items() if name not in lists}
    content = {
        "cases": cases,
        **{name: values[name] for name in lists},
        **{f"{key}s": {column.name: column.described(key) for column in columns} for key in _KEYS},
        "about": dict(about),
    }
    check_size({"cases": sum(_bytes(value) for value in cases.values())})
    savemat(path, content, appendmat=False, long_field_names=True, oned_as="column")
    return len(next(iter(values.values())))


def check_size(sizes: Mapping[str, int]) -> None:
    """Refuse variables that a MAT-file cannot hold.

    Raises
    ------
    InputError
        If a variable is too large, with its name and the remedy.
    """
    for name, size in sizes.items():
        if size > LIMIT:
            raise InputError(
                f"{name} would have {size / 1e9:.1f} GB, and a variable of a MAT-file has at most {LIMIT / 1e9:.1f} "
                "GB; write HDF5 instead, to a name that ends in .h5, or fewer rows with a condition"
            )


_KEYS = ("unit", "description", "formula")


def _matlab(column: ExportColumn, parts: list[Values]) -> NDArray[np.generic]:
    """Values of batches as one variable: matrices of different widths are padded with nan."""
    if column.is_text:
        return np.array([text for part in parts for text in part], dtype=object)[:, None]
    arrays = [np.asarray(part) for part in parts]
    if not column.is_list:
        return np.concatenate([np.empty(0), *arrays])[:, None]
    width = max((array.shape[1] for array in arrays), default=0)
    whole = np.full((sum(map(len, arrays)), width), np.nan, np.float32)
    for stop, array in zip(np.cumsum([len(array) for array in arrays]), arrays, strict=True):
        whole[stop - len(array) : stop, : array.shape[1]] = array
    return whole


def _bytes(values: NDArray[np.generic]) -> int:
    """Bytes in the file; a cell has a header of some 64 bytes and two bytes a character."""
    if values.dtype == object:
        return sum(64 + 2 * len(str(text)) for text in values.ravel())
    return int(values.nbytes)
