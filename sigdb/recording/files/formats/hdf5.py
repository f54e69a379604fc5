"""HDF5 files, among them MAT-files of version 7.3."""

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    MAX_DEPTH,
    Contents,
    StoredArray,
    check_bytes,
    check_parts,
    check_values,
)
from sigdb.recording.files.formats.hdf5_dataset import dataset_problem, has_variable_text, numbers_of, text_attribute
from sigdb.recording.files.formats.mat73 import read_mat73
from sigdb.recording.files.formats.named_arrays import ArrayFacts, contents_of_arrays, not_read, rate_of
from sigdb.recording.files.settings import RecordingSettings

if TYPE_CHECKING:
    import h5py

FOREIGN: tuple[type[Exception], ...] = (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError)


def read_hdf5(path: Path, settings: RecordingSettings) -> Contents:
    """Read all datasets of numbers as columns ``group/dataset``; in MAT-files ``structure.field``.

    Attributes ``unit`` or ``units`` of a dataset, of fixed length, are its unit. A sampling rate may be an attribute or
    a dataset.
    """
    h5py = _h5py()
    check_bytes(path.stat().st_size)
    with h5py.File(path, "r") as file:
        if _is_mat(path):
            return read_mat73(h5py, file, variable=settings.variable)
        arrays = _NamedArrays(h5py, file)
        arrays.walk(file, "", 0)
    return contents_of_arrays(
        arrays.arrays,
        variable=settings.variable,
        left_out=tuple(arrays.left_out),
        facts=arrays.facts,
    )


class _NamedArrays:
    """Arrays by name with units and rates from their attributes, and notes on the parts that cannot be read."""

    def __init__(self, h5py: ModuleType, file: "h5py.File") -> None:
        self.arrays: dict[str, StoredArray] = {}
        self.facts: dict[str, ArrayFacts] = {}
        self.left_out: list[Note] = []
        self._h5py, self._file = h5py, file
        self._parts = self._values = 0

    def walk(self, group: "h5py.Group", name: str, depth: int) -> None:
        """Take all items of a group and of the groups in it."""
        if depth > MAX_DEPTH:
            raise InputError(f"holds groups {MAX_DEPTH} levels deep, so it is not a recording")
        self._note_rates(group, name)
        for key in self._keys(group):
            self._parts += 1
            check_parts(self._parts)
            link = group.get(key, getlink=True)
            if not isinstance(link, self._h5py.HardLink):
                self.left_out.append(not_read(key, "a link, which is not followed"))
            else:
                self._take(group[key], f"{name}/{key}" if name else key, depth)

    def _keys(self, group: "h5py.Group") -> Iterator[str]:
        """Return the names in a group without those that MATLAB adds."""
        check_parts(len(group))
        return (key for key in group if not key.startswith("#"))

    def _take(self, item: "h5py.HLObject", name: str, depth: int) -> None:
        if isinstance(item, self._h5py.Group):
            self.walk(item, name, depth + 1)
        elif isinstance(item, self._h5py.Dataset):
            self._keep(item, name)

    def _keep(self, item: "h5py.Dataset", name: str) -> None:
        problem = dataset_problem(item)
        if problem:
            self.left_out.append(not_read(name, problem))
            return
        self._values += item.size
        check_values(self._values)
        unit = text_attribute(item, "unit") or text_attribute(item, "units")
        if has_variable_text(item, "unit") or has_variable_text(item, "units"):
            text = f"the unit of {name} is text of variable length, which is not read; give units"
            self.left_out.append(Note(code="unit-not-read", text=text, values={"name": name}))
        rates = {key: rate for key, value in _scalars(item) if (rate := rate_of(key, value)) is not None}
        source, rate = next(iter(rates.items()), ("the file", None))
        for part, values in numbers_of(item):
            self.arrays[f"{name}{part}"] = values
            self.facts[f"{name}{part}"] = ArrayFacts(unit=unit, sampling_rate=rate, rate_from=source)

    def _note_rates(self, group: "h5py.Group", name: str) -> None:
        """Keep sampling rates in the attributes of a group as if they were datasets in it."""
        for key, value in _scalars(group):
            if rate_of(key, value) is not None:
                self.arrays[f"{name}/{key}" if name else key] = np.asarray(value)


def _scalars(item: "h5py.HLObject") -> Iterator[tuple[str, np.number]]:
    """Yield the attributes that are a single number."""
    check_parts(len(item.attrs))
    for key in item.attrs:
        kind = item.attrs.get_id(key)
        if kind.dtype.kind in "iuf" and kind.shape in ((), (1,)):
            yield key, item.attrs[key]


def _is_mat(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(10) == b"MATLAB 7.3"


def _h5py() -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise InputError("is HDF5, which needs h5py, which is not installed: pip install 'sigdb[readers]'") from None
    return h5py
