"""MAT-files of version 5: arrays of numbers, also in structures and cells."""

import zlib
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core.errors import InputError
from sigdb.measurement.readers.contents import Contents
from sigdb.measurement.readers.limits import MAX_DEPTH, bounded_bytes, check_parts, check_values
from sigdb.measurement.readers.mat5_elements import COMPRESSED, MATRIX, Element, elements, unpacked
from sigdb.measurement.readers.named_arrays import contents_of
from sigdb.measurement.recording_settings import RecordingSettings

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
    """Columns of all arrays; fields of a structure are ``name.field``, elements ``name(2).field`` and ``name{2}``."""
    data = memoryview(bounded_bytes(path))
    if len(data) < 128:
        raise InputError("is cut short: a MAT-file begins with 128 bytes")
    order = "<" if bytes(data[126:128]) == b"IM" else ">"
    found = _Found()
    given = 0
    for element in elements(data[128:], order):
        if element.kind == COMPRESSED:
            element = unpacked(element, len(data), given)
            given += len(element.data)
        if element.kind == MATRIX:
            found.take(element)
    return contents_of(found.arrays, variable=settings.variable, left_out=tuple(found.left_out))


class _Found:
    """Arrays by name, and what cannot be read."""

    def __init__(self) -> None:
        self.arrays: dict[str, np.ndarray[Any, Any]] = {}
        self.left_out: list[str] = []
        self._parts = 0

    def take(self, element: Element, name: str | None = None, depth: int = 0) -> None:
        """A matrix, and all in it."""
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
            own = parts[1].text() if kind == OPAQUE and len(parts) > 1 else ""
            self._leave(name or own or "a variable without a name", UNREAD[kind])
            return
        if len(parts) < 3:
            raise InputError("is damaged: a variable without dimensions and name")
        shape, own = _shape(parts[1]), parts[2].text()
        name = own if name is None else name
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
        fields = [
            packed[i : i + length].split(b"\0")[0].decode("latin-1") for i in range(0, len(packed), length)
        ]
        one = int(np.prod(shape, dtype=object)) == 1
        names = [
            f"{name}.{fields[i % len(fields)]}" if one else f"{name}({i // len(fields) + 1}).{fields[i % len(fields)]}"
            for i in range(len(parts) - 2)
        ] if fields else []
        self._take_all(parts[2:], names, depth)

    def _take_all(self, parts: list[Element], names: list[str], depth: int) -> None:
        for part, name in zip(parts, names, strict=False):
            if part.kind == MATRIX:
                self.take(part, name, depth + 1)

    def _keep(self, name: str, values: np.ndarray[Any, Any]) -> None:
        if name in self.arrays:
            raise InputError(f"holds the variable {name} twice; save it again with different names")
        self.arrays[name] = values

    def _leave(self, name: str, what: str) -> None:
        if name.strip("\0"):
            self.left_out.append(f"{name} is {what}, which cannot be read; {REMEDY}")


def _limited(element: Element) -> Any:
    for i, part in enumerate(elements(element.data, element.order)):
        check_parts(i)
        yield part


def _shape(element: Element) -> tuple[int, ...]:
    shape = tuple(int(length) for length in element.numbers()[:9])
    if not 2 <= len(shape) <= 8 or min(shape) < 0:
        raise InputError(f"is damaged: a variable of dimensions {shape}")
    check_values(int(np.prod(shape, dtype=object)))
    return shape


def _matrix(parts: list[Element], shape: tuple[int, ...], *, complex_numbers: bool) -> np.ndarray[Any, Any]:
    count = int(np.prod(shape, dtype=object))
    if not parts:
        raise InputError("is damaged: a variable without numbers")
    values = [part.numbers() for part in parts[: 2 if complex_numbers else 1]]
    if any(one.size != count for one in values):
        raise InputError(f"is damaged: a variable of dimensions {shape} holds {values[0].size} numbers")
    stored = values[0] + 1j * values[1] if len(values) > 1 else values[0]
    return stored.reshape(shape, order="F")
