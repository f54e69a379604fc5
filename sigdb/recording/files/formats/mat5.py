"""MAT-files of version 5: arrays of numbers, also inside structures and cells."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
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
from sigdb.recording.files.formats.named_arrays import contents_of_arrays, not_read
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

CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
UNREAD = {
    OBJECT: "an object",
    SPARSE: "a sparse matrix",
    FUNCTION: "a function",
    OPAQUE: "an object, such as a table or a timetable",
}
REMEDY = "save its columns as arrays of numbers"


def read_mat5(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of all arrays.

    Fields of a structure are ``name.field``, elements are ``name(2).field`` and ``name{2}``.
    """
    data = memoryview(bounded_bytes(path))
    if len(data) < 128:
        raise InputError("is cut short: a MAT-file begins with 128 bytes")
    order = "<" if bytes(data[126:128]) == b"IM" else ">"
    arrays = _NamedArrays()
    expanded = 0
    for element in elements(data[128:], order):
        if element.kind == COMPRESSED:
            element = unpack(element, len(data), expanded)
            expanded += len(element.data)
        if element.kind == MATRIX:
            arrays.take(element)
    return contents_of_arrays(arrays.arrays, variable=settings.variable, left_out=tuple(arrays.left_out))


class _NamedArrays:
    """Arrays by name, and notes on the parts that cannot be read."""

    def __init__(self) -> None:
        self.arrays: dict[str, StoredArray] = {}
        self.left_out: list[Note] = []
        self._parts = 0

    def take(self, element: Element, name: str | None = None, depth: int = 0) -> None:
        """Take a matrix and all elements in it."""
        if depth > MAX_DEPTH:
            raise InputError(f"holds structures {MAX_DEPTH} levels deep, so it is not a recording")
        self._parts += 1
        check_parts(self._parts)
        parts = list(_limited(element))
        if not parts:  # an empty matrix
            return
        flags = int(parts[0].numbers()[:1].sum())
        kind = flags & 0xFF
        if kind in (OPAQUE, FUNCTION):
            stored_name = parts[1].text() if kind == OPAQUE and len(parts) > 1 else ""
            self._leave(name or stored_name or "a variable without a name", UNREAD[kind])
            return
        if len(parts) < 3:
            raise InputError("is damaged: a variable without dimensions and name")
        shape = _shape(parts[1])
        name = parts[2].text() if name is None else name
        if kind in UNREAD:
            self._leave(name, UNREAD[kind])
        elif kind == CELL:
            self._take_all(parts[3:], [f"{name}{{{i + 1}}}" for i in range(len(parts) - 3)], depth)
        elif kind == STRUCT:
            self._take_structure(parts[3:], name, shape, depth)
        elif kind != CHAR:
            self._keep(name, _matrix(parts[3:], shape, complex_numbers=bool(flags & 0x0800)))

    def _take_structure(self, parts: list[Element], name: str, shape: tuple[int, ...], depth: int) -> None:
        length = int(parts[0].numbers()[:1].sum()) if parts else 0
        if not 0 < length <= 1024 or len(parts) < 2:
            raise InputError(f"is damaged: the structure {name} has names of fields of {length} bytes")
        packed = bytes(parts[1].data)
        check_parts(len(packed) // length)
        fields = [packed[i : i + length].split(b"\0")[0].decode("latin-1") for i in range(0, len(packed), length)]
        single = int(np.prod(shape, dtype=object)) == 1
        places = [divmod(i, len(fields)) for i in range(len(parts) - 2)] if fields else []
        names = [f"{name}{'' if single else f'({element + 1})'}.{fields[field]}" for element, field in places]
        self._take_all(parts[2:], names, depth)

    def _take_all(self, parts: list[Element], names: list[str], depth: int) -> None:
        for part, name in zip(parts, names, strict=False):
            if part.kind == MATRIX:
                self.take(part, name, depth + 1)

    def _keep(self, name: str, values: StoredArray) -> None:
        if name in self.arrays:
            raise InputError(f"holds the variable {name} twice; save it again with different names")
        self.arrays[name] = values

    def _leave(self, name: str, kind: str) -> None:
        if name.strip("\0"):
            self.left_out.append(not_read(name, f"{kind}, which cannot be read; {REMEDY}"))


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
