"""Datasets of HDF5: what is refused before it is read, and the numbers of what is read."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sigdb.core.errors import InputError
from sigdb.measurement.readers.limits import (
    check_bytes,
    check_columns,
    check_parts,
    check_ratio,
    check_values,
)

FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 4: "szip", 5: "nbit", 6: "scaleoffset", 32000: "lzf"}


LONGEST_TEXT = 1000
"""Bytes of an attribute."""


def dataset_problem(item: Any) -> str:
    """Why a dataset is no series of numbers; empty if it is one.

    Raises
    ------
    InputError
        If it is larger than a recording may be, or much larger than what is stored of it.
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


def _check_storage(item: Any) -> None:
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


def numbers_of(item: Any) -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    """The array of a dataset, or those of its fields, with what is added to its name."""
    values = item[()]
    for name in item.dtype.names or ():
        yield f".{name}", values[name]
    if not item.dtype.names:
        yield "", np.asarray(values)


def text_attribute(item: Any, name: str) -> str:
    """What an attribute of fixed length says; empty if there is none, or it is no text of a bounded length.

    Text of variable length stands in a heap, in whose damage the HDF5 library may search without end.
    """
    if name not in item.attrs:
        return ""
    kind = item.attrs.get_id(name)
    if kind.dtype.kind != "S" or kind.shape != () or kind.dtype.itemsize > LONGEST_TEXT:
        return ""
    return bytes(item.attrs[name]).decode("utf-8", "replace")


def has_variable_text(item: Any, name: str) -> bool:
    """Whether an attribute is text of variable length, which is not read."""
    return name in item.attrs and item.attrs.get_id(name).dtype.kind == "O"
