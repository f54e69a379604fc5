"""An export as a MAT-file of version 5, which MATLAB, Octave and SciPy read; made in memory, so of limited size."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import InputError
from sigdb.database.export.columns import ExportColumn, joined

LIMIT = 2**31 - 1
"""Bytes that a variable of a MAT-file of version 5 may have."""


def write_mat(
    path: Path, columns: Sequence[ExportColumn], batches: Iterable[dict[str, Any]], about: Mapping[str, str]
) -> int:
    """Write batches and give the number of rows.

    Variables: ``cases``, a struct of columns (rows, 1), text as cells; each list column, (rows, n) single; ``units``,
    ``descriptions`` and ``formulas``, structs with the columns' names; ``about``.
    """
    from scipy.io import savemat  # slow to load

    parts = list(batches)
    values = {column.name: _matlab(column, [part[column.name] for part in parts]) for column in columns}
    lists = [column.name for column in columns if column.is_list]
    content = {
        "cases": {name: value for name, value in values.items() if name not in lists},
        **{name: values[name] for name in lists},
        **{f"{key}s": {column.name: column.described(key) for column in columns} for key in _KEYS},
        "about": dict(about),
    }
    check_size({"cases": sum(_bytes(value) for value in content["cases"].values())})
    savemat(path, content, appendmat=False, long_field_names=True, oned_as="column")
    return len(next(iter(values.values())))


def check_size(sizes: Mapping[str, int]) -> None:
    """Refuse variables that a MAT-file cannot hold.

    Raises
    ------
    InputError
        Names the variable and the remedy.
    """
    for name, size in sizes.items():
        if size > LIMIT:
            raise InputError(
                f"{name} would have {size / 1e9:.1f} GB, and a variable of a MAT-file has at most {LIMIT / 1e9:.1f} "
                "GB; write HDF5 instead, to a name that ends in .h5, or fewer rows with a condition"
            )


_KEYS = ("unit", "description", "formula")


def _matlab(column: ExportColumn, parts: list[Any]) -> Any:
    if not parts:
        return np.empty((0, 0 if column.is_list else 1), dtype=object if column.is_text else float)
    values = joined(parts)
    return values if column.is_list else np.array(values, dtype=object if column.is_text else float)[:, None]


def _bytes(values: Any) -> int:
    """Bytes in the file, where a cell has a header of some 64 beside its text."""
    if values.dtype == object:
        return sum(64 + 2 * len(text) for text in values.ravel())
    return int(values.nbytes)
