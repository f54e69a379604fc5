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
    check_columns,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.formats.named_arrays import ArrayFacts, contents_of_arrays, not_read, rate_of
from sigdb.recording.files.settings import RecordingSettings

if TYPE_CHECKING:
    import h5py

FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 4: "szip", 5: "nbit", 6: "scaleoffset", 32000: "lzf"}

LONGEST_TEXT = 1000
"""Largest size of a text attribute, bytes."""


def dataset_problem(item: "h5py.Dataset") -> str:
    """Return why a dataset is no series of numbers; an empty text if it is one.

    Raises
    ------
    InputError
        If it is larger than a recording may be, or much larger than its stored bytes.
    """
    kinds = [item.dtype[name] for name in item.dtype.names] if item.dtype.names else [item.dtype]
    if any(kind.kind not in "biufc" or kind.subdtype for kind in kinds):
        return "not numbers, so not a channel"
    if item.shape is None or item.size == 0:
        return "empty"
    if item.is_virtual or item.external:
        return "kept in other files, which are not read"
    check_columns(len(kinds))
    check_values(item.size * len(kinds))
    check_bytes(item.nbytes)
    _check_storage(item)
    return ""


def _check_storage(item: "h5py.Dataset") -> None:
    if item.chunks is None:
        return
    check_bytes(int(np.prod(item.chunks, dtype=object)) * item.dtype.itemsize)
    stored = item.id.get_storage_size()
    chunk = int(np.prod(item.chunks, dtype=object)) * item.dtype.itemsize
    check_ratio(max(item.nbytes, chunk), stored)
    properties = item.id.get_create_plist()
    check_parts(properties.get_nfilters())
    for i in range(properties.get_nfilters()):
        code = properties.get_filter(i)[0]
        if code not in FILTERS:
            raise InputError(f"{item.name} is compressed by filter {code}; known: {', '.join(FILTERS.values())}")


def numbers_of(item: "h5py.Dataset") -> Iterator[tuple[str, StoredArray]]:
    """Yield the array of a dataset, or the arrays of its fields, each with its suffix to the dataset's name."""
    values = item[()]
    for name in item.dtype.names or ():
        yield f".{name}", values[name]
    if not item.dtype.names:
        yield "", np.asarray(values)


def text_attribute(item: "h5py.Dataset", name: str) -> str:
    """Return a text attribute of fixed, bounded length; an empty text if there is none.

    Text of variable length is not read: it is stored in a heap, and in a damaged heap the HDF5 library may search
    without end.
    """
    if name not in item.attrs:
        return ""
    kind = item.attrs.get_id(name)
    if kind.dtype.kind != "S" or kind.shape != () or kind.dtype.itemsize > LONGEST_TEXT:
        return ""
    return bytes(item.attrs[name]).decode("utf-8", "replace")


def has_variable_text(item: "h5py.Dataset", name: str) -> bool:
    """Return whether an attribute is text of variable length, which is not read."""
    return name in item.attrs and item.attrs.get_id(name).dtype.kind == "O"


FOREIGN: tuple[type[Exception], ...] = (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError)


def read_hdf5(path: Path, settings: RecordingSettings) -> Contents:
    """Read all datasets of numbers as columns ``group/dataset``; in MAT-files ``structure.field``.

    Attributes ``unit`` or ``units`` of a dataset, of fixed length, are its unit. A sampling rate may be an attribute or
    a dataset.
    """
    h5py = _h5py()
    check_bytes(path.stat().st_size)
    with h5py.File(path, "r") as file:
        arrays = _NamedArrays(h5py, file, "." if _is_mat(path) else "/")
        arrays.walk(file, "", 0)
    return contents_of_arrays(
        arrays.arrays,
        variable=settings.variable,
        left_out=tuple(arrays.left_out),
        facts=arrays.facts,
    )


class _NamedArrays:
    """Arrays by name with units and rates from their attributes, and notes on the parts that cannot be read."""

    def __init__(self, h5py: ModuleType, file: "h5py.File", mark: str) -> None:
        self.arrays: dict[str, StoredArray] = {}
        self.facts: dict[str, ArrayFacts] = {}
        self.left_out: list[Note] = []
        self._h5py, self._file, self._mark = h5py, file, mark
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
                self._take(group[key], f"{name}{self._mark}{key}" if name else key, depth)

    def _keys(self, group: "h5py.Group") -> Iterator[str]:
        """Return the names in a group without those that MATLAB adds."""
        check_parts(len(group))
        return (key for key in group if not key.startswith("#"))

    def _take(self, item: "h5py.HLObject", name: str, depth: int) -> None:
        if isinstance(item, self._h5py.Group):
            self.walk(item, name, depth + 1)
        elif isinstance(item, self._h5py.Dataset):
            self._take_dataset(item, name, depth)

    def _take_dataset(self, item: "h5py.Dataset", name: str, depth: int) -> None:
        kind = text_attribute(item, "MATLAB_class")
        if "MATLAB_object_decode" in item.attrs or kind in ("table", "timetable", "datetime", "function_handle"):
            reason = f"a {kind or 'object'}, which cannot be read; save its columns as arrays"
            self.left_out.append(not_read(name, reason))
        elif kind == "cell" and self._h5py.check_ref_dtype(item.dtype) is self._h5py.Reference:
            self._take_cells(item, name, depth)
        elif kind != "char" and "MATLAB_empty" not in item.attrs:
            self._keep(item, name)

    def _take_cells(self, item: "h5py.Dataset", name: str, depth: int) -> None:
        check_parts(item.size)
        if depth > MAX_DEPTH:
            raise InputError(f"holds cells {MAX_DEPTH} levels deep, so it is not a recording")
        for i, reference in enumerate(item[()].reshape(-1)):
            self._parts += 1
            check_parts(self._parts)
            if reference:
                self._take(self._file[reference], f"{name}{{{i + 1}}}", depth + 1)

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
                self.arrays[f"{name}{self._mark}{key}" if name else key] = np.asarray(value)


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
