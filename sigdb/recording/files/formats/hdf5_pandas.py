"""Data frames that pandas stores in HDF5 files: of fixed format, or as a table."""

import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import StoredArray, check_columns, check_parts
from sigdb.recording.files.formats.hdf5_attributes import AttributeReader
from sigdb.recording.files.formats.hdf5_dataset import LONGEST_LIST, check_storage, listed_names, numbers_of
from sigdb.recording.files.formats.time_ticks import seconds_of_ticks

if TYPE_CHECKING:
    import h5py

Series: TypeAlias = tuple[str, StoredArray | str, str]
"""Name, numbers, and unit of a series; words in place of numbers that cannot be read."""

GetDataset: TypeAlias = Callable[[str], "h5py.Dataset | None"]


def pandas_series(kind: str, get: GetDataset, attributes: AttributeReader) -> Iterator[Series] | None:
    """Return the series of a group that pandas wrote; None if it is none that is known.

    Parameters
    ----------
    kind
        Attribute ``pandas_type`` of the group.
    get
        Returns a dataset of the group by its name, None if there is none.
    attributes
        Reader of attributes.
    """
    if kind == "frame":
        return _fixed(get, attributes)
    if kind == "series":
        return _series(get, attributes)
    if kind in ("frame_table", "series_table", "appendable_frame"):
        return _table(get, attributes)
    return None


def _fixed(get: GetDataset, attributes: AttributeReader) -> Iterator[Series]:
    """Yield the index, then the columns in the order of the frame."""
    order = _labels(get("axis0"))
    yield from _index(get("axis1"), attributes, order)
    columns: dict[str, Series] = {}
    for number in range(len(order)):
        values, items = get(f"block{number}_values"), get(f"block{number}_items")
        if values is None or items is None:
            break
        numbers = numbers_of(values)
        labels = _labels(items)
        matrix = numbers.arrays.get("")
        if matrix is None or matrix.shape[1:] != (len(labels),):
            columns |= {label: (label, numbers.problem or "damaged", "") for label in labels}
            continue
        kind = attributes.text(values, "value_type")
        columns |= {label: _converted(label, matrix[:, i], kind) for i, label in enumerate(labels)}
    yield from (columns[label] for label in order if label in columns)


def _series(get: GetDataset, attributes: AttributeReader) -> Iterator[Series]:
    yield from _index(get("index"), attributes, ["values"])
    values = get("values")
    if values is not None:
        numbers = numbers_of(values)
        stored = numbers.arrays.get("", numbers.problem or "damaged")
        kind = attributes.text(values, "value_type")
        yield "values", stored, ""
        if kind:
            raise InputError(f"holds a series of {kind}, which is no channel")


def _table(get: GetDataset, attributes: AttributeReader) -> Iterator[Series]:
    table = get("table")
    if table is None:
        return
    fields = table.dtype.names or ()
    check_parts(len(fields))
    names = {name: _pickled_names(table, f"{name}_kind") for name in fields}
    numbers = numbers_of(table, names)
    if numbers.problem:
        yield "table", numbers.problem, ""
        return
    field_of = {label: name for name, labels in names.items() for label in labels}
    labels = [suffix[1:] for suffix in numbers.arrays]
    for label, values in zip(labels, numbers.arrays.values(), strict=True):
        name = field_of.get(label, label)
        kind = attributes.text(table, f"{name}_{'kind' if name == 'index' else 'dtype'}")
        if not _counts_rows(label, values):
            yield _converted(_time_name(label, kind, labels), values, kind)
    for name in numbers.left_out:
        yield name, "not numbers, so not a channel", ""


def _counts_rows(name: str, values: StoredArray) -> bool:
    """Return whether a series is the index that pandas gives to a frame without one."""
    return name == "index" and values.dtype.kind in "iu" and np.array_equal(values, np.arange(values.size))


def _pickled_names(table: "h5py.Dataset", key: str) -> list[str]:
    kind = table.attrs.get_id(key) if key in table.attrs else None
    if kind is None or kind.dtype.kind != "S" or kind.shape != () or kind.dtype.itemsize > LONGEST_LIST:
        return []
    return listed_names(bytes(table.attrs[key]))


def _index(item: "h5py.Dataset | None", attributes: AttributeReader, columns: list[str]) -> Iterator[Series]:
    """Yield the index, unless it only counts rows."""
    if item is None:
        return
    numbers = numbers_of(item)
    kind = attributes.text(item, "kind")
    stated = attributes.text(item, "name")
    name = stated if re.fullmatch(r"\w[\w ()\[\]/%-]*", stated) and stated not in columns else "index"
    stored = numbers.arrays.get("")
    if stored is None:
        yield name, numbers.problem or "damaged", ""
    elif not _counts_rows(name, stored):
        yield _converted(_time_name(name, kind, columns), stored, kind)


def _time_name(name: str, kind: str, columns: list[str]) -> str:
    """Return the name of a column; that of an index of dates or durations says that it is a time."""
    if name != "index" or not kind.startswith(("datetime64", "timedelta64")):
        return name
    return name if {"time", ".time"} & set(columns) else "time"


def _converted(name: str, values: StoredArray, kind: str) -> Series:
    """Return a series; dates become seconds after the first one, durations seconds."""
    match = re.match(r"(datetime64|timedelta64)(?:\[(\w+))?", kind)
    if match is None or values.dtype.kind not in "iu":
        return name, values, ""
    return name, seconds_of_ticks(values, match[2] or "ns", after_first=match[1] == "datetime64"), "s"


def _labels(item: "h5py.Dataset | None") -> list[str]:
    """Return the names in a dataset of fixed texts or of numbers."""
    if item is None or item.ndim != 1 or item.dtype.kind not in "Siuf" or item.is_virtual or item.external:
        return []
    check_columns(item.size)
    if item.dtype.itemsize > LONGEST_LIST:
        return []
    check_storage(item)
    return [value.decode("utf-8", "replace") if isinstance(value, bytes) else f"{value}" for value in item[()].tolist()]
