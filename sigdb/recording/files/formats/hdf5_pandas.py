"""Data frames that pandas stores in HDF5 files: of fixed format, or as a table."""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import SHORTEST_BLOCK, StoredArray, check_columns, check_parts
from sigdb.recording.files.formats.hdf5_attributes import AttributeReader
from sigdb.recording.files.formats.hdf5_dataset import LONGEST_LIST, check_storage, listed_names, numbers_of
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow
from sigdb.recording.files.formats.time_ticks import seconds_of_ticks

if TYPE_CHECKING:
    import h5py

_DATE = "datetime64"


@dataclass(frozen=True, kw_only=True)
class Series:
    """A series of a frame.

    Attributes
    ----------
    name, unit
        Its name and its unit.
    values
        Its numbers in a window of samples; words in place of numbers that cannot be read.
    size
        Its length in the file.
    """

    name: str
    values: StoredArray | str
    unit: str = ""
    size: int = 0


GetDataset: TypeAlias = Callable[[str], "h5py.Dataset | None"]
"""Returns a dataset of the group by its name, None if there is none."""


def pandas_series(
    kind: str, get: GetDataset, attributes: AttributeReader, window: SampleWindow
) -> Iterator[Series] | None:
    """Return the series of a group that pandas wrote; None if it is none that is known.

    Parameters
    ----------
    kind
        Attribute ``pandas_type`` of the group.
    get
        Returns a dataset of the group by its name, None if there is none.
    attributes
        Reader of attributes.
    window
        Rows to read.
    """
    readers = {
        "frame": _fixed, "series": _series, "frame_table": _table, "series_table": _table, "appendable_frame": _table
    }  # fmt: skip
    return readers[kind](get, attributes, window) if kind in readers else None


def _fixed(get: GetDataset, attributes: AttributeReader, window: SampleWindow) -> Iterator[Series]:
    """Yield the index, then the columns in the order of the frame."""
    order = _labels(get("axis0"))
    yield from _index(get("axis1"), attributes, order, window)
    columns: dict[str, Series] = {}
    for number in range(len(order)):
        values, items = get(f"block{number}_values"), get(f"block{number}_items")
        if values is None or items is None:
            break
        numbers = numbers_of(values, window=window, axis=0)
        labels = _labels(items)
        matrix = numbers.arrays.get("")
        if matrix is None or matrix.shape[1:] != (len(labels),):
            columns |= {label: Series(name=label, values=numbers.problem or "damaged") for label in labels}
            continue
        kind = attributes.text(values, "value_type")
        first = _first_row(values, kind)
        for i, label in enumerate(labels):
            of_first = None if first is None else first[i]
            columns[label] = _converted(label, matrix[:, i], kind, size=values.shape[0], first=of_first)
    yield from (columns[label] for label in order if label in columns)


def _series(get: GetDataset, attributes: AttributeReader, window: SampleWindow) -> Iterator[Series]:
    yield from _index(get("index"), attributes, ["values"], window)
    values = get("values")
    if values is not None:
        numbers = numbers_of(values, window=window)
        stored = numbers.arrays.get("", numbers.problem or "damaged")
        kind = attributes.text(values, "value_type")
        yield Series(name="values", values=stored, size=values.size or 0)
        if kind:
            raise InputError(f"holds a series of {kind}, which is no channel")


def _table(get: GetDataset, attributes: AttributeReader, window: SampleWindow) -> Iterator[Series]:
    table = get("table")
    if table is None:
        return
    fields = table.dtype.names or ()
    check_parts(len(fields))
    names = {name: _pickled_names(table, f"{name}_kind") for name in fields}
    numbers = numbers_of(table, names, window=window)
    if numbers.problem:
        yield Series(name="table", values=numbers.problem)
        return
    field_of = {label: name for name, labels in names.items() for label in labels}
    labels = [suffix[1:] for suffix in numbers.arrays]
    firsts: Mapping[str, StoredArray] | None = None
    for label, values in zip(labels, numbers.arrays.values(), strict=True):
        name = field_of.get(label, label)
        kind = attributes.text(table, f"{name}_{'kind' if name == 'index' else 'dtype'}")
        size = math.prod(numbers.shapes[f".{label}"])
        if name == "index" and _counts_rows(table, values, window, "index"):
            continue
        if kind.startswith(_DATE):
            firsts = firsts or numbers_of(table, names, window=SampleWindow(0, 1)).arrays
        first = firsts[f".{label}"][0] if firsts is not None else None
        yield _converted(_time_name(label, kind, labels), values, kind, size=size, first=first)
    for name in numbers.left_out:
        yield Series(name=name, values="not numbers, so not a channel")


def _counts_rows(item: "h5py.Dataset", values: StoredArray, window: SampleWindow, field: str | None = None) -> bool:
    """Return whether an index is the one that pandas gives to a frame without one.

    Raises
    ------
    InputError
        If it counts the first rows, and others leap.
    """
    if values.dtype.kind not in "iu":
        return False
    counts = np.array_equal(values, np.arange(values.size) + window.first)
    if window == WHOLE or counts or not values.size:
        return counts
    begin = np.asarray((item if field is None else item.fields(field))[:SHORTEST_BLOCK])
    if np.array_equal(begin, np.arange(begin.size)):
        raise InputError(
            f"its index counts rows and leaps between rows {window.first} and {window.first + values.size}: rows are "
            "missing there; cut the recording in two"
        )
    return False


def _pickled_names(table: "h5py.Dataset", key: str) -> list[str]:
    kind = table.attrs.get_id(key) if key in table.attrs else None
    if kind is None or kind.dtype.kind != "S" or kind.shape != () or kind.dtype.itemsize > LONGEST_LIST:
        return []
    return listed_names(bytes(table.attrs[key]))


def _index(
    item: "h5py.Dataset | None", attributes: AttributeReader, columns: list[str], window: SampleWindow
) -> Iterator[Series]:
    """Yield the index, unless it only counts rows."""
    if item is None:
        return
    numbers = numbers_of(item, window=window)
    kind = attributes.text(item, "kind")
    stated = attributes.text(item, "name")
    name = stated if re.fullmatch(r"\w[\w ()\[\]/%-]*", stated) and stated not in columns else "index"
    stored = numbers.arrays.get("")
    if stored is None:
        yield Series(name=name, values=numbers.problem or "damaged")
    elif name != "index" or not _counts_rows(item, stored, window):
        first = _first_row(item, kind)
        yield _converted(_time_name(name, kind, columns), stored, kind, size=item.size, first=first)


def _first_row(item: "h5py.Dataset", kind: str) -> StoredArray | None:
    """Return the first row of a dataset of dates; None for other datasets."""
    return np.asarray(item[0]) if kind.startswith(_DATE) else None


def _time_name(name: str, kind: str, columns: list[str]) -> str:
    """Return the name of a column; that of an index of dates or durations says that it is a time."""
    if name != "index" or not kind.startswith(("datetime64", "timedelta64")):
        return name
    return name if {"time", ".time"} & set(columns) else "time"


def _converted(name: str, values: StoredArray, kind: str, *, size: int, first: StoredArray | None) -> Series:
    """Return a series; dates become seconds after ``first``, the first one, durations seconds."""
    match = re.match(r"(datetime64|timedelta64)(?:\[(\w+))?", kind)
    if match is None or values.dtype.kind not in "iu":
        return Series(name=name, values=values, size=size)
    since = None if first is None else int(first)
    seconds = seconds_of_ticks(values, match[2] or "ns", after_first=match[1] == _DATE, first=since)
    return Series(name=name, values=seconds, unit="s", size=size)


def _labels(item: "h5py.Dataset | None") -> list[str]:
    """Return the names in a dataset of fixed texts or of numbers."""
    if item is None or item.ndim != 1 or item.dtype.kind not in "Siuf" or item.is_virtual or item.external:
        return []
    check_columns(item.size)
    if item.dtype.itemsize > LONGEST_LIST:
        return []
    check_storage(item)
    return [value.decode("utf-8", "replace") if isinstance(value, bytes) else f"{value}" for value in item[()].tolist()]
