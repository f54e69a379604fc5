"""Datasets of HDF5 files, read within the limits of a recording."""

import math
import pickletools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import (
    StoredArray,
    check_bytes,
    check_columns,
    check_expansion,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.formats.named_arrays import SHORTEST
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow

if TYPE_CHECKING:
    import h5py

FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 4: "szip", 5: "nbit", 6: "scaleoffset", 32000: "lzf"}

LONGEST_LIST = 2**16
"""Largest size of a list of names in an attribute, bytes."""


@dataclass(frozen=True, kw_only=True)
class DatasetNumbers:
    """The arrays of a dataset, each by its suffix to the dataset's name.

    Attributes
    ----------
    arrays
        One array with an empty suffix, or an array of each field of numbers, with the suffix ``.field``.
    shapes
        Shape of each array in the file, where a window of samples was read.
    left_out
        Names of the fields that are no numbers.
    problem
        Reason for which a dataset has no arrays.
    """

    arrays: Mapping[str, StoredArray] = field(default_factory=dict)
    shapes: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    problem: str = ""


def numbers_of(
    item: "h5py.Dataset",
    names: Mapping[str, list[str]] | None = None,
    *,
    window: SampleWindow = WHOLE,
    axis: int | None = None,
) -> DatasetNumbers:
    """Return the numbers of a dataset.

    Parameters
    ----------
    item
        The dataset.
    names
        Names of the columns of those fields that hold several numbers; by default they are counted.
    window
        Samples to read; datasets of fewer than 16 numbers are read whole.
    axis
        Axis along which the samples run; the longest by default.

    Raises
    ------
    InputError
        If it is larger than a recording may be, or much larger than its stored bytes.
    """
    fields = {name: item.dtype[name] for name in item.dtype.names or ()}
    numeric = [name for name, kind in fields.items() if kind.base.kind in "biufc" and len(kind.shape) <= 1]
    problem = _problem(item, [fields[name] for name in numeric] if fields else [item.dtype], window)
    if problem:
        return DatasetNumbers(problem=problem)
    if not fields:
        return DatasetNumbers(arrays={"": windowed(item, window, axis)}, shapes={"": item.shape})
    stored = windowed(item, window, axis, numeric)
    shapes: dict[str, tuple[int, ...]] = {}
    arrays: dict[str, StoredArray] = {}
    for name in numeric:
        values = stored[name]
        if not fields[name].shape:
            arrays[f".{name}"], shapes[f".{name}"] = values, item.shape
            continue
        columns = values.reshape(-1, values.shape[-1])
        labels = (names or {}).get(name, [])
        labels = labels if len(labels) == columns.shape[1] else [f"{name}{i + 1}" for i in range(columns.shape[1])]
        arrays |= {f".{label}": columns[:, i] for i, label in enumerate(labels)}
        shapes |= {f".{label}": (item.size,) for label in labels}
    return DatasetNumbers(arrays=arrays, shapes=shapes, left_out=tuple(name for name in fields if name not in numeric))


def windowed(
    item: "h5py.Dataset", window: SampleWindow, axis: int | None = None, fields: list[str] | None = None
) -> StoredArray:
    """Return the samples of a dataset in a window, and all of a short dataset; of some fields, or of all."""
    stored = item if fields is None else item.fields(fields)
    if window == WHOLE or item.size < SHORTEST:
        return np.asarray(stored[()])
    return np.asarray(stored[window.index(item.shape, window.axis(item.shape) if axis is None else axis)])


def dataset_problem(item: "h5py.Dataset", window: SampleWindow = WHOLE) -> str:
    """Return why a dataset is no series of numbers; an empty text if it is one.

    Raises
    ------
    InputError
        If it is larger than a recording may be, or much larger than its stored bytes.
    """
    kinds = [item.dtype[name] for name in item.dtype.names] if item.dtype.names else [item.dtype]
    return _problem(item, kinds, window)


def _problem(item: "h5py.Dataset", kinds: list[np.dtype], window: SampleWindow) -> str:
    if not kinds or any(kind.base.kind not in "biufc" for kind in kinds):
        return "not numbers, so not a channel"
    if item.shape is None or item.size == 0:
        return "empty"
    if item.is_virtual or item.external:
        return "kept in other files, which are not read"
    columns = sum(int(np.prod(kind.shape, dtype=object)) for kind in kinds)
    check_columns(columns)
    size = math.prod(window.shape(item.shape, window.axis(item.shape)))
    check_values(size * columns)
    check_bytes(size * item.dtype.itemsize)
    check_storage(item, window)
    return ""


def check_storage(item: "h5py.Dataset", window: SampleWindow = WHOLE) -> None:
    """Refuse a dataset that expands to far more than its stored bytes, or is compressed in a way that is not read."""
    import h5py

    if item.chunks is None:
        return
    chunk = int(np.prod(item.chunks, dtype=object)) * item.dtype.itemsize
    check_bytes(chunk)
    check = check_ratio if window == WHOLE else check_expansion
    check(max(item.nbytes, chunk), item.id.get_storage_size())
    properties = item.id.get_create_plist()
    check_parts(properties.get_nfilters())
    for i in range(properties.get_nfilters()):
        code = properties.get_filter(i)[0]
        if code not in FILTERS or not h5py.h5z.filter_avail(code):
            name = FILTERS.get(code, f"filter {code}")
            raise InputError(f"{item.name} is compressed by {name}, which is not read; write it with gzip, or without")


def listed_names(pickled: bytes) -> list[str]:
    """Return the texts in a pickled list, which is not run; an empty list if it holds anything else.

    Examples
    --------
    >>> import pickle
    >>> listed_names(pickle.dumps(["a1", "a2"], 0)), listed_names(pickle.dumps([1], 0))
    (['a1', 'a2'], [])
    """
    names = []
    try:
        for code, text, _ in pickletools.genops(pickled[:LONGEST_LIST]):
            if code.name in ("UNICODE", "BINUNICODE", "SHORT_BINUNICODE") and isinstance(text, str):
                names.append(text)
            elif code.name not in _OF_LISTS:
                return []
    except (ValueError, UnicodeError):
        return []
    return names


_OF_LISTS = {
    "PROTO", "FRAME", "MARK", "LIST", "EMPTY_LIST", "APPEND", "APPENDS", "PUT", "BINPUT", "LONG_BINPUT", "MEMOIZE",
    "STOP",
}  # fmt: skip
