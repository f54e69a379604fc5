"""An export as HDF5, written batch by batch: memory is bounded, however large the database."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.database.export.columns import ExportColumn, Values

_CHUNK_ROWS = {1: 8192, 2: 256}


def write_hdf5(
    path: Path, columns: Iterable[ExportColumn], batches: Iterable[Mapping[str, Values]], about: Mapping[str, str]
) -> int:
    """Write batches and return the number of rows.

    Datasets without lists are in the group ``cases``, (rows,) float64 or text; lists at the top, (rows, n) float32.
    Each has the attributes ``column``, ``unit``, ``description`` and ``formula``.

    Raises
    ------
    InputError
        If h5py is not installed.
    """
    h5py = _h5py()
    rows = 0
    with h5py.File(path, "w") as file:
        file.attrs.update(about)
        datasets = {column.name: _dataset(h5py, file, column) for column in columns}
        for values in batches:
            for name, part in values.items():
                _append(datasets[name], rows, np.asarray(part, dtype=datasets[name].dtype))
            rows += len(next(iter(values.values())))
    return rows


def _dataset(h5py: ModuleType, file: Any, column: ExportColumn) -> Any:
    dimensions = 2 if column.is_list else 1
    dataset = (file if column.is_list else file.require_group("cases")).create_dataset(
        column.name,
        shape=(0,) * dimensions,
        maxshape=(None,) * dimensions,
        chunks=(_CHUNK_ROWS[dimensions], 128)[:dimensions],
        dtype=h5py.string_dtype() if column.is_text else np.float32 if column.is_list else np.float64,
        fillvalue=None if column.is_text else np.nan,
    )
    for key in ("unit", "description", "formula"):
        dataset.attrs[key] = column.described(key)
    dataset.attrs["column"] = column.field.name
    return dataset


def _append(dataset: Any, rows: int, part: FloatArray) -> None:
    width = tuple(max(old, new) for old, new in zip(dataset.shape[1:], part.shape[1:], strict=True))
    dataset.resize((rows + len(part), *width))
    if part.size:
        dataset[(slice(rows, None), *(slice(size) for size in part.shape[1:]))] = part


def _h5py() -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise InputError("HDF5 needs h5py, which is not installed: pip install h5py") from None
    module: ModuleType = h5py
    return module
