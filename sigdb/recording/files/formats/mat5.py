"""MAT-files of version 5: arrays of numbers, also inside structures, cells, tables and timetables."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import (
    FREE_BYTES,
    MAX_BYTES,
    MAX_DEPTH,
    MAX_RATIO,
    Contents,
    StoredArray,
    bounded_bytes,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.formats.matlab_objects import ObjectStore
from sigdb.recording.files.formats.matlab_tables import read_object
from sigdb.recording.files.formats.matlab_values import Cells, ObjectReference, Structures, Unread, Value, Workspace
from sigdb.recording.files.settings import RecordingSettings

MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}


@dataclass(frozen=True)
class Element:
    """Type and bytes of an element of a MAT-file; ``order`` is ``<`` or ``>``."""

    kind: int
    data: memoryview
    order: str

    def numbers(self) -> StoredArray:
        """Return the element as numbers of the type in which they are stored."""
        if self.kind not in NUMBERS:
            raise InputError(f"is damaged: an element of type {self.kind} where numbers belong")
        dtype = np.dtype(self.order + NUMBERS[self.kind])
        return np.frombuffer(self.data, dtype, len(self.data) // dtype.itemsize)

    def text(self) -> str:
        """Return the element as text."""
        coding = TEXTS.get(self.kind, "latin-1")
        ends = {"<": "-le", ">": "-be"}[self.order] if coding in ("utf-16", "utf-32") else ""
        return bytes(self.data).decode(coding + ends, "replace")


def elements(data: memoryview, order: str) -> Iterator[Element]:
    """Yield all elements in their order."""
    at = 0
    while at + 8 <= len(data):
        kind, size = np.frombuffer(data, f"{order}u4", 2, at).tolist()
        small = kind >> 16
        if small:  # up to four bytes, within the tag
            if small > 4:
                raise InputError(f"is damaged: a small element of {small} bytes")
            yield Element(kind & 0xFFFF, data[at + 4 : at + 4 + small], order)
            at += 8
            continue
        if size > len(data) - at - 8:
            raise InputError(f"is cut short or damaged: an element of {size} bytes, {len(data) - at - 8} are left")
        yield Element(kind, data[at + 8 : at + 8 + size], order)
        at += 8 + (size if kind == COMPRESSED else -(-size // 8) * 8)


def unpack(element: Element, packed: int, expanded: int) -> Element:
    """Return the element inside a compressed one.

    The file has ``packed`` bytes, and ``expanded`` bytes have been unpacked from it so far.
    """
    stream = zlib.decompressobj()
    most = min(MAX_BYTES, max(FREE_BYTES, MAX_RATIO * packed)) - expanded
    data = stream.decompress(element.data, max(most, 0) + 1)
    if len(data) > most:
        check_ratio(expanded + len(data), packed)
        raise InputError(f"expands to more than {MAX_BYTES} bytes; cut it into shorter recordings")
    return next(elements(memoryview(data), element.order), Element(0, memoryview(b""), element.order))


FOREIGN: tuple[type[Exception], ...] = (zlib.error,)

CELL, STRUCT, OBJECT, CHAR, SPARSE, UINT8, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 9, 16, 17
UNREAD = {OBJECT: "an object", SPARSE: "a sparse matrix", FUNCTION: "a function"}
COMPLEX = 0x0800


def read_mat5(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of all arrays, also in structures, cells, tables and timetables."""
    data = memoryview(bounded_bytes(path))
    if len(data) < 128:
        raise InputError("is cut short: a MAT-file begins with 128 bytes")
    order = "<" if bytes(data[126:128]) == b"IM" else ">"
    workspace, store = Workspace(), ObjectStore()
    reader = _MatrixReader()
    expanded = 0
    for element in elements(data[128:], order):
        if element.kind == COMPRESSED:
            element = unpack(element, len(data), expanded)
            expanded += len(element.data)
        if element.kind != MATRIX:
            continue
        name, value = reader.read(element)
        if name:
            workspace.add(name, value)
        elif isinstance(value, np.ndarray) and value.dtype == np.uint8:
            store = ObjectStore(partial(_cells_of_objects, memoryview(value.tobytes(order="F"))))
    return workspace.contents(partial(read_object, store), variable=settings.variable)


def _cells_of_objects(data: memoryview) -> tuple[Value, ...]:
    """Return the cells with the objects of a file. They lie in a matrix of bytes, which is like a file of its own."""
    order = {b"IM": "<", b"MI": ">"}.get(bytes(data[2:4]))
    reader = _MatrixReader()
    for element in elements(data[8:], order or "<"):
        value = reader.read(element)[1] if element.kind == MATRIX else None
        if isinstance(value, Structures) and len(value.elements) == 1:
            wrapped = value.elements[0].get("MCOS")
            return wrapped.items if isinstance(wrapped, Cells) else ()
    return ()


class _MatrixReader:
    """Reader of matrices with a bounded number of parts."""

    def __init__(self) -> None:
        self._parts = 0

    def read(self, element: Element, depth: int = 0) -> tuple[str, Value]:
        """Return the name and the value of a matrix."""
        if depth > MAX_DEPTH:
            raise InputError(f"holds structures {MAX_DEPTH} levels deep, so it is not a recording")
        self._parts += 1
        check_parts(self._parts)
        parts = list(_limited(element))
        if not parts:  # an empty matrix
            return "", np.zeros((0, 0))
        flags = int(parts[0].numbers()[:1].sum())
        kind = flags & 0xFF
        if kind == OPAQUE:
            return self._object(parts, depth)
        if len(parts) < 3 and kind != FUNCTION:
            raise InputError("is damaged: a variable without dimensions and name")
        name = parts[2].text().strip("\0") if len(parts) > 2 else ""
        if kind in UNREAD:
            return name, Unread(UNREAD[kind])
        shape = _shape(parts[1])
        if kind == CELL:
            return name, Cells(tuple(self.read(part, depth + 1)[1] for part in parts[3:] if part.kind == MATRIX))
        if kind == STRUCT:
            return name, self._structures(parts[3:], name, shape, depth)
        if kind == CHAR:
            return name, parts[3].text() if len(parts) > 3 and shape[0] == 1 else ""
        return name, _matrix(parts[3:], shape, complex_numbers=bool(flags & COMPLEX))

    def _object(self, parts: list[Element], depth: int) -> tuple[str, Value]:
        """Return an object of MATLAB's own classes: its name, its system, its class, and words that refer to it."""
        if len(parts) < 5 or parts[4].kind != MATRIX:
            return parts[1].text() if len(parts) > 1 else "", Unread("an object")
        name, system, class_name = (part.text().strip("\0") for part in parts[1:4])
        value = self.read(parts[4], depth + 1)[1]
        if class_name == "FileWrapper__":
            return name, value
        if system != "MCOS" or not isinstance(value, np.ndarray):
            return name, Unread(f"a {class_name or 'object'}")
        return name, ObjectReference(class_name, value)

    def _structures(self, parts: list[Element], name: str, shape: tuple[int, ...], depth: int) -> Structures:
        length = int(parts[0].numbers()[:1].sum()) if parts else 0
        if not 0 < length <= 1024 or len(parts) < 2:
            raise InputError(f"is damaged: the structure {name} has names of fields of {length} bytes")
        packed = bytes(parts[1].data)
        check_parts(len(packed) // length)
        keys = [packed[i : i + length].split(b"\0")[0].decode("latin-1") for i in range(0, len(packed), length)]
        values = [self.read(part, depth + 1)[1] if part.kind == MATRIX else np.zeros((0, 0)) for part in parts[2:]]
        count = int(np.prod(shape, dtype=object)) if keys else 0
        if len(values) < count * len(keys):
            raise InputError(f"is damaged: the structure {name} lacks fields")
        rows = [values[i : i + len(keys)] for i in range(0, count * len(keys), len(keys) or 1)]
        return Structures(tuple(dict(zip(keys, row, strict=True)) for row in rows))


def _limited(element: Element) -> Iterator[Element]:
    for i, part in enumerate(elements(element.data, element.order)):
        check_parts(i)
        yield part


def _shape(element: Element) -> tuple[int, ...]:
    shape = tuple(int(length) for length in element.numbers()[:9])
    if not 2 <= len(shape) <= 8 or min(shape) < 0:
        raise InputError(f"is damaged: a variable of dimensions {shape}")
    check_values(int(np.prod(shape, dtype=object)))
    return shape


def _matrix(parts: list[Element], shape: tuple[int, ...], *, complex_numbers: bool) -> StoredArray:
    count = int(np.prod(shape, dtype=object))
    if not parts:
        raise InputError("is damaged: a variable without numbers")
    values = [part.numbers() for part in parts[: 2 if complex_numbers else 1]]
    if any(part.size != count for part in values):
        raise InputError(f"is damaged: a variable of dimensions {shape} holds {values[0].size} numbers")
    stored = values[0] + 1j * values[1] if len(values) > 1 else values[0]
    return stored.reshape(shape, order="F")
