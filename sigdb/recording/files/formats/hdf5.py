"""HDF5 files, among them MAT-files of version 7.3 and frames of pandas."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from mmap import ACCESS_READ, mmap
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
from sigdb.recording.files.formats.hdf5_attributes import AttributeReader, facts_of
from sigdb.recording.files.formats.hdf5_dataset import numbers_of
from sigdb.recording.files.formats.hdf5_pandas import Series, pandas_series
from sigdb.recording.files.formats.mat73 import read_mat73
from sigdb.recording.files.formats.named_arrays import ArrayFacts, contents_of_arrays, not_read, rate_of
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow, window_blocks
from sigdb.recording.files.settings import RecordingSettings

if TYPE_CHECKING:
    import h5py

FREQUENCIES = ("hz", "khz", "hertz", "rad/s", "1/s", "s^-1", "cpm")
"""Units of frequencies, in small letters."""

FOREIGN: tuple[type[Exception], ...] = (OSError, RuntimeError, ValueError, KeyError, TypeError, MemoryError)


def read_hdf5(path: Path, settings: RecordingSettings) -> Contents:
    """Read all datasets of numbers as columns ``group/dataset``; in MAT-files ``structure.field``.

    Attributes of a dataset, or of the groups around it, state its unit, its sampling rate and its start. A sampling
    rate may be a dataset too.
    """
    check_bytes(path.stat().st_size)
    return _contents(path, settings, WHOLE)


def hdf5_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the columns of all datasets of numbers in blocks, each dataset along its longest axis.

    Parameters
    ----------
    path
        The file.
    settings
        Settings of reading; variable is used.
    samples
        Samples of a block.
    """
    return window_blocks(partial(_contents, path, settings), samples)


def _contents(path: Path, settings: RecordingSettings, window: SampleWindow) -> Contents:
    h5py = _h5py()
    with h5py.File(path, "r") as file:
        if _is_mat(path):
            return read_mat73(h5py, file, variable=settings.variable, window=window)
        with path.open("rb") as stored, mmap(stored.fileno(), 0, access=ACCESS_READ) as data:
            attributes = AttributeReader(h5py, file, data)
            arrays = _NamedArrays(h5py, attributes, window)
            arrays.walk(file, "", ArrayFacts(), 0)
    if attributes.unread:
        text = "some texts of variable length, such as units, cannot be read; give units"
        arrays.left_out.append(Note(code="texts-not-read", text=text))
    return contents_of_arrays(
        arrays.arrays,
        variable=settings.variable,
        left_out=tuple(arrays.left_out),
        facts=arrays.facts_of_arrays(),
        texts=arrays.texts,
        shapes=arrays.shapes,
    )


class _NamedArrays:
    """Arrays by name with the facts in their attributes, and notes on the parts that cannot be read."""

    def __init__(self, h5py: ModuleType, attributes: AttributeReader, window: SampleWindow) -> None:
        self.arrays: dict[str, StoredArray] = {}
        self.shapes: dict[str, tuple[int, ...]] = {}
        self.facts: dict[str, ArrayFacts] = {}
        self.texts: dict[str, str] = {}
        self.left_out: list[Note] = []
        self._abscissas: dict[str, str] = {}
        self._h5py, self._attributes, self._window = h5py, attributes, window
        self._parts = self._values = 0

    def walk(self, group: "h5py.Group", name: str, facts: ArrayFacts, depth: int) -> None:
        """Take all items of a group and of the groups in it; ``facts`` are those of the groups around it."""
        if depth > MAX_DEPTH:
            raise InputError(f"holds groups {MAX_DEPTH} levels deep, so it is not a recording")
        kind = self._attributes.text(group, "pandas_type")
        series = pandas_series(kind, lambda key: self._dataset(group, key), self._attributes, self._window)
        if series is not None:
            self._keep_series(name, series)
            return
        facts = self._facts_of_group(group, name, facts)
        check_parts(len(group))
        for key in group:
            self._parts += 1
            check_parts(self._parts)
            if not self._is_member(group, key):
                self.left_out.append(not_read(key, "a link, which is not followed"))
            elif isinstance(item := group[key], self._h5py.Group):
                self.walk(item, _joined(name, key), facts, depth + 1)
            elif isinstance(item, self._h5py.Dataset):
                self._keep(item, _joined(name, key), facts)

    def _is_member(self, group: "h5py.Group", key: str) -> bool:
        return isinstance(group.get(key, getlink=True), self._h5py.HardLink)

    def _dataset(self, group: "h5py.Group", key: str) -> "h5py.Dataset | None":
        item = group[key] if key in group and self._is_member(group, key) else None
        return item if isinstance(item, self._h5py.Dataset) else None

    def _facts_of_group(self, group: "h5py.Group", name: str, inherited: ArrayFacts) -> ArrayFacts:
        """Return the unit and the start that hold in a group. Its sampling rate becomes an array or a text in it."""
        attributes = self._attributes.values(group)
        for key, value in attributes.items():
            if isinstance(value, str):
                self.texts[_joined(name, key)] = value
            elif rate_of(key, value) is not None:
                self.arrays[_joined(name, key)] = np.asarray(value)
        facts = facts_of(attributes, inherited)
        return replace(facts, sampling_rate=None, rate_from=ArrayFacts().rate_from)

    def _keep_series(self, group: str, series: Iterator[Series]) -> None:
        for each in series:
            name = _joined(group, each.name)
            if isinstance(each.values, str):
                self.left_out.append(not_read(name, each.values))
            else:
                self._keep_array(name, each.values, ArrayFacts(unit=each.unit), (each.size,))

    def _keep(self, item: "h5py.Dataset", name: str, inherited: ArrayFacts) -> None:
        text = self._attributes.scalar_text(item)
        if text:
            self.texts[name] = text
            return
        numbers = numbers_of(item, window=self._window)
        if numbers.problem:
            self.left_out.append(not_read(name, numbers.problem))
            return
        facts = facts_of(self._attributes.values(item), inherited)
        self._note_scale(item, facts.unit)
        for suffix, values in numbers.arrays.items():
            self._keep_array(f"{name}{suffix}", values, facts, numbers.shapes[suffix])
        self.left_out += [not_read(f"{name}.{field}", "not numbers, so not a channel") for field in numbers.left_out]

    def _note_scale(self, item: "h5py.Dataset", unit: str) -> None:
        """Keep the datasets whose samples run along a dataset, if that is a scale of another quantity than time."""
        if self._attributes.text(item, "CLASS") != "DIMENSION_SCALE" or "REFERENCE_LIST" not in item.attrs:
            return
        label = self._attributes.text(item, "NAME") or str(item.name).rsplit("/", 1)[-1]
        if unit.strip().lower() not in FREQUENCIES and not label.strip().lower().startswith("freq"):
            return
        listed = item.attrs.get_id("REFERENCE_LIST")
        kinds = [listed.dtype[key] for key in listed.dtype.names or ()]
        if len(kinds) != 2 or self._h5py.check_ref_dtype(kinds[0]) is None or kinds[1].kind not in "iu":
            return
        check_parts(int(np.prod(listed.shape, dtype=object)))
        for entry in np.reshape(item.attrs["REFERENCE_LIST"], -1):
            if entry[0]:
                self._abscissas[str(item.file[entry[0]].name).strip("/")] = label

    def facts_of_arrays(self) -> dict[str, ArrayFacts]:
        """Return the facts about all arrays, with the quantity along their samples."""
        return {
            name: replace(facts, abscissa=self._abscissas.get(name, facts.abscissa))
            for name, facts in self.facts.items()
        }

    def _keep_array(self, name: str, values: StoredArray, facts: ArrayFacts, shape: tuple[int, ...]) -> None:
        self._values += values.size
        check_values(self._values)
        self.arrays[name], self.shapes[name] = values, shape
        self.facts[name] = facts


def _joined(group: str, key: str) -> str:
    return f"{group}/{key}" if group else key


def _is_mat(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(10) == b"MATLAB 7.3"


def _h5py() -> ModuleType:
    try:
        import h5py
    except ImportError:
        raise InputError("is HDF5, which needs h5py, which is not installed: pip install h5py") from None
    return h5py
