"""Properties of the objects of a MAT-file."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import NotApplicableError
from sigdb.recording.files.formats.contents import MAX_PARTS, StoredArray
from sigdb.recording.files.formats.matlab_values import Cells, ObjectReference, Structures, Value

MARK = 0xDD000000
"""First word of a reference to an object."""

NAMES_FROM = 40
"""Byte of the first cell at which the list of names begins."""

SHARED_CELLS = {2: 1, 3: 2, 4: 3}
"""Cells at the end that hold no property, by the version of the format."""


class ObjectStore:
    """The properties of all objects of a file, which MATLAB keeps in a list of cells.

    The first cell holds names and lists of integers. The cells from the third on hold properties. The last cell holds
    the default properties of each class. ``read_cells`` returns them when the first object is read.
    """

    def __init__(self, read_cells: Callable[[], tuple[Value, ...]] = tuple) -> None:
        self._read_cells = read_cells

    def class_name(self, reference: ObjectReference) -> str:
        """Return the class of an object.

        Raises
        ------
        NotApplicableError
            If the file does not state it in a form that is understood.
        """
        return self._lists.class_name(_numbers_of_object(reference)[1])

    def properties(self, reference: ObjectReference) -> Mapping[str, Value]:
        """Return the properties of an object by name.

        Raises
        ------
        NotApplicableError
            If the file does not state them in a form that is understood.
        """
        object_number, class_number = _numbers_of_object(reference)
        properties = dict(self._defaults_of(class_number))
        for name, cell in self._lists.cells_of(object_number):
            if not 0 <= cell < len(self._saved):
                raise NotApplicableError(f"its property {name} is not in the file")
            properties[name] = self._saved[cell]
        return {name: _with_reference(value) for name, value in properties.items()}

    @cached_property
    def _cells(self) -> tuple[Value, ...]:
        return self._read_cells()

    @cached_property
    def _lists(self) -> "_Lists":
        if len(self._cells) < 3 or not isinstance(self._cells[0], np.ndarray):
            raise NotApplicableError("the file holds no properties of objects")
        return _Lists(self._cells[0].tobytes(order="F"))

    @cached_property
    def _saved(self) -> tuple[Value, ...]:
        return self._cells[2 : len(self._cells) - SHARED_CELLS[self._lists.version]]

    def _defaults_of(self, class_number: int) -> Mapping[str, Value]:
        shared = self._cells[-1]
        stored = shared.items[class_number] if isinstance(shared, Cells) and class_number < len(shared.items) else None
        return stored.elements[0] if isinstance(stored, Structures) and len(stored.elements) == 1 else {}


@dataclass(frozen=True)
class _Lists:
    """Names and lists of integers in the first cell of the objects."""

    data: bytes

    @cached_property
    def version(self) -> int:
        return self._header[0]

    def class_name(self, number: int) -> str:
        """Return the name of a class, after that of its package."""
        package, name = _row(self._list(0), number, 4)[:2]
        return f"{self._name(package)}.{self._name(name)}" if package else self._name(name)

    def cells_of(self, number: int) -> list[tuple[str, int]]:
        """Return the names of the properties of an object, each with the number of its cell."""
        _, _, _, saved, normal, _ = _row(self._list(2), number, 6)
        block = _block(self._list(1), saved) if saved else _block(self._list(3), normal)
        triples = block.reshape(-1, 3).tolist()
        return [(self._name(name), cell) for name, kind, cell in triples if kind == 1]

    def _name(self, number: int) -> str:
        if not 1 <= number <= len(self._names):
            raise NotApplicableError("its names are damaged")
        return self._names[number - 1]

    @cached_property
    def _header(self) -> tuple[int, ...]:
        """Return the version, the number of names, and the bytes at which the lists begin."""
        if len(self.data) >= NAMES_FROM:
            for order in "<>":
                header = tuple(np.frombuffer(self.data, f"{order}i4", 7).tolist())
                places = header[2:]
                if header[0] in SHARED_CELLS and places[0] >= NAMES_FROM and places[-1] <= len(self.data):
                    if list(places) != sorted(places) or any(place % 4 for place in places):
                        break
                    return header
        raise NotApplicableError("its properties are damaged, or of a version that is not known")

    @cached_property
    def _names(self) -> list[str]:
        packed = self.data[NAMES_FROM : self._header[2]]
        return [name.decode("utf-8", "replace") for name in packed.split(b"\0", MAX_PARTS) if name]

    def _list(self, number: int) -> StoredArray:
        begin, end = self._header[2 + number : 4 + number]
        order = "<" if self.data[0] else ">"
        return np.frombuffer(self.data[begin:end], f"{order}i4")


def _row(numbers: StoredArray, row: int, length: int) -> list[int]:
    values: list[int] = numbers[row * length : (row + 1) * length].tolist()
    if row < 1 or len(values) < length:
        raise NotApplicableError("its number is not in the file")
    return values


def _block(numbers: StoredArray, number: int) -> StoredArray:
    """Return the integers of a block. Each begins with the number of its triples and ends at an even place."""
    at = 0
    for _ in range(min(number, MAX_PARTS) if number >= 0 else 0):
        if at >= numbers.size or numbers[at] < 0:
            break
        at += 1 + 3 * int(numbers[at])
        at += at % 2
    count = int(numbers[at]) if at < numbers.size else -1
    if not 0 <= 3 * count < numbers.size - at:
        raise NotApplicableError("the list of its properties is damaged")
    return numbers[at + 1 : at + 1 + 3 * count]


def _numbers_of_object(reference: ObjectReference) -> tuple[int, int]:
    """Return the numbers of a single object and of its class."""
    words = [int(word) for word in reference.words.reshape(-1, order="F")[:16]]
    dimensions = words[2 : 2 + words[1]] if len(words) > 2 and words[0] == MARK and words[1] <= 8 else []
    if not dimensions or any(length != 1 for length in dimensions) or len(words) != len(dimensions) + 4:
        raise NotApplicableError("it is no single object")
    return words[-2], words[-1]


def _with_reference(value: Value) -> Value:
    """Return a value; an array that refers to an object becomes a reference, also in cells and structures."""
    if isinstance(value, np.ndarray):
        is_reference = value.dtype == np.uint32 and value.size >= 4 and value.reshape(-1)[0] == MARK
        return ObjectReference("", value) if is_reference else value
    if isinstance(value, Cells):
        return Cells(tuple(_with_reference(item) for item in value.items))
    if isinstance(value, Structures):
        return Structures(
            tuple({key: _with_reference(part) for key, part in element.items()} for element in value.elements)
        )
    return value
