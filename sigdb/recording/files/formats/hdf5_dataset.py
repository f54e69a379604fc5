"""Datasets and attributes of HDF5 files, read within the limits of a recording."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import (
    StoredArray,
    check_bytes,
    check_columns,
    check_parts,
    check_ratio,
    check_values,
)

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
