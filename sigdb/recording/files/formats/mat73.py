"""MAT-files of version 7.3, which are HDF5 files: arrays, also inside structures, cells, tables and timetables."""

from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import InputError, NotApplicableError
from sigdb.recording.files.formats.contents import MAX_DEPTH, Contents, StoredArray, check_parts, check_values
from sigdb.recording.files.formats.hdf5_attributes import fixed_text
from sigdb.recording.files.formats.hdf5_dataset import dataset_problem, windowed
from sigdb.recording.files.formats.matlab_objects import ObjectStore
from sigdb.recording.files.formats.matlab_tables import read_object
from sigdb.recording.files.formats.matlab_values import (
    LONGEST_TEXT,
    ArrayPart,
    Cells,
    ObjectArrays,
    ObjectReference,
    Structures,
    Unread,
    Value,
    Workspace,
)
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow

if TYPE_CHECKING:
    import h5py

EMPTY = np.zeros((0, 0))


def read_mat73(h5py: ModuleType, file: "h5py.File", *, variable: str | None, window: SampleWindow = WHOLE) -> Contents:
    """Return the samples of all arrays of an opened file in a window; tables and dates are read whole or not at all."""
    workspace = Workspace()
    reader = _ValueReader(h5py, file, window)
    for key in reader.keys(file):
        workspace.add(key, reader.member(file, key, 0))
    store = ObjectStore(partial(_cells_of_objects, h5py, file))
    read = partial(read_object if window == WHOLE else _text_object, store)
    return workspace.contents(read, variable=variable)


def _text_object(store: ObjectStore, name: str, reference: ObjectReference) -> ObjectArrays:
    """Return the text of an object, which may state a fact; other objects are not read in blocks."""
    if store.class_name(reference) != "string":
        raise NotApplicableError("in blocks, arrays of numbers are read")
    return read_object(store, name, reference)


def _cells_of_objects(h5py: ModuleType, file: "h5py.File") -> tuple[Value, ...]:
    group = file.get("#subsystem#")
    if not isinstance(group, h5py.Group) or "MCOS" not in group:
        return ()
    value = _ValueReader(h5py, file, WHOLE).member(group, "MCOS", 0)
    return value.items if isinstance(value, Cells) else ()


class _ValueReader:
    """Reader of values with a bounded number of parts and numbers."""

    def __init__(self, h5py: ModuleType, file: "h5py.File", window: SampleWindow) -> None:
        self._h5py, self._file, self._window = h5py, file, window
        self._parts = self._numbers = 0

    def keys(self, group: "h5py.Group") -> list[str]:
        """Return the names in a group without those that MATLAB adds."""
        check_parts(len(group))
        return [key for key in group if not key.startswith("#")]

    def member(self, group: "h5py.Group", key: str, depth: int) -> Value:
        """Return a member of a group; links are not followed."""
        link = group.get(key, getlink=True)
        if not isinstance(link, self._h5py.HardLink):
            return Unread("a link, which is not followed")
        return self._value(group[key], depth)

    def _value(self, item: "h5py.HLObject", depth: int) -> Value:
        if depth > MAX_DEPTH:
            raise InputError(f"holds structures {MAX_DEPTH} levels deep, so it is not a recording")
        self._parts += 1
        check_parts(self._parts)
        kind = fixed_text(item, "MATLAB_class")
        if isinstance(item, self._h5py.Group):
            return self._structures(item, kind, depth)
        if not isinstance(item, self._h5py.Dataset):
            return Unread("a named type")
        if "MATLAB_empty" in item.attrs:
            return EMPTY
        if kind == "cell" or kind == "FileWrapper__":
            return Cells(tuple(self._value(part, depth + 1) for part in self._referred(item)))
        if "MATLAB_object_decode" in item.attrs:
            words = self._array(item, WHOLE)
            return ObjectReference(kind or "object", words) if isinstance(words, np.ndarray) else words
        return self._text(item) if kind == "char" else self._part(item)

    def _structures(self, group: "h5py.Group", kind: str, depth: int) -> Value:
        if "MATLAB_sparse" in group.attrs:
            return Unread("a sparse matrix")
        if kind not in ("struct", "") or "MATLAB_object_decode" in group.attrs:
            return Unread("a function" if kind == "function_handle" else f"a {kind or 'object'}")
        keys = self.keys(group)
        columns = {key: self._elements(group, key) for key in keys}
        if not keys or any(column is None for column in columns.values()):
            return Structures(({key: self.member(group, key, depth + 1) for key in keys},))
        rows = zip(*(column or [] for column in columns.values()), strict=False)
        return Structures(
            tuple({key: self._value(item, depth + 1) for key, item in zip(keys, row, strict=True)} for row in rows)
        )

    def _elements(self, group: "h5py.Group", key: str) -> list["h5py.HLObject"] | None:
        """Return the values of a field in each element of an array of structures; None if it is a single value."""
        link = group.get(key, getlink=True)
        item = group[key] if isinstance(link, self._h5py.HardLink) else None
        if not isinstance(item, self._h5py.Dataset) or "MATLAB_class" in item.attrs:
            return None
        return self._referred(item) if self._is_references(item) else None

    def _is_references(self, item: "h5py.Dataset") -> bool:
        return self._h5py.check_ref_dtype(item.dtype) is self._h5py.Reference

    def _referred(self, item: "h5py.Dataset") -> list["h5py.HLObject"]:
        if not self._is_references(item) or item.shape is None:
            raise InputError("is damaged: a cell array holds no references")
        check_parts(item.size)
        return [self._file[reference] for reference in item[()].reshape(-1) if reference]

    def _part(self, item: "h5py.Dataset") -> Value:
        """Return the numbers of a dataset in the window."""
        values = self._array(item, self._window)
        if self._window == WHOLE or isinstance(values, Unread):
            return values
        return ArrayPart(values, np.atleast_2d(np.broadcast_to(0, item.shape)).T.shape)

    def _array(self, item: "h5py.Dataset", window: SampleWindow) -> StoredArray | Unread:
        """Return the numbers of a dataset, whose dimensions MATLAB stores in the opposite order."""
        problem = dataset_problem(item, window)
        if problem:
            return Unread(f"a dataset ({problem})")
        shape = item.shape[::-1]
        axis = len(shape) - 1 - window.axis(shape)
        stored = windowed(item, window, axis)
        self._numbers += stored.size
        check_values(self._numbers)
        if stored.dtype.names == ("real", "imag"):
            stored = stored["real"] + 1j * stored["imag"]
        if stored.dtype.names:
            return Unread("a dataset of several fields")
        return np.atleast_2d(stored).T

    def _text(self, item: "h5py.Dataset") -> str:
        """Return a text of one row."""
        if item.ndim != 2 or item.shape[1] != 1 or item.size > LONGEST_TEXT or item.dtype.kind != "u":
            return ""
        codes = self._array(item, WHOLE)
        return "" if isinstance(codes, Unread) else codes.astype("<u2").tobytes().decode("utf-16-le", "replace")
