"""Values of MATLAB's workspace as MAT-files of every version hold them, and their arrays by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from sigdb.core import InputError, NotApplicableError, Note
from sigdb.recording.files.formats.contents import MAX_DEPTH, Contents, StoredArray, check_parts
from sigdb.recording.files.formats.named_arrays import ArrayFacts, contents_of_arrays, not_read

LONGEST_TEXT = 1000
"""Largest length of a text that may state a fact about a recording, signs."""

REMEDY = "save its columns as arrays of numbers"


@dataclass(frozen=True)
class Cells:
    """A cell array, in the order of its columns."""

    items: tuple["Value", ...]


@dataclass(frozen=True)
class Structures:
    """The elements of an array of structures, each with its fields by name."""

    elements: tuple[Mapping[str, "Value"], ...]


@dataclass(frozen=True)
class ObjectReference:
    """An object; ``words`` refer to the part of the file that holds its properties."""

    class_name: str
    words: StoredArray


@dataclass(frozen=True)
class Unread:
    """A value that is not read; ``kind`` names it."""

    kind: str


@dataclass(frozen=True)
class ArrayPart:
    """Some samples of an array; ``shape`` is that of the array."""

    values: StoredArray
    shape: tuple[int, ...]


Value: TypeAlias = StoredArray | ArrayPart | str | Cells | Structures | ObjectReference | Unread
"""An array of numbers of two dimensions or more, a text, or one of the other kinds."""


@dataclass(frozen=True, kw_only=True)
class ObjectArrays:
    """Arrays, facts and texts of an object by name, and notes on its other parts."""

    arrays: Mapping[str, StoredArray] = field(default_factory=dict)
    facts: Mapping[str, ArrayFacts] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()


ReadObject: TypeAlias = Callable[[str, ObjectReference], ObjectArrays]
"""Returns the arrays of an object of this name; raises :class:`NotApplicableError` if its kind is not read."""


class Workspace:
    """The variables of a MAT-file by name. The last of two variables of a name is taken, with a note."""

    def __init__(self) -> None:
        self._variables: dict[str, Value] = {}
        self._arrays: dict[str, StoredArray] = {}
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._facts: dict[str, ArrayFacts] = {}
        self._texts: dict[str, str] = {}
        self._notes: list[Note] = []
        self._parts = 0

    def add(self, name: str, value: Value) -> None:
        """Add a variable."""
        if name in self._variables:
            text = f"{name} is stored more than once; the last one was taken"
            self._notes.append(Note(code="variable-stored-twice", text=text, values={"name": name}))
        self._variables[name] = value
        check_parts(len(self._variables))

    def contents(self, read_object: ReadObject, *, variable: str | None) -> Contents:
        """Return the columns of all arrays, also in structures, cells and objects.

        Fields of a structure are ``name.field``, elements are ``name(2).field`` and ``name{2}``.
        """
        for name, value in self._variables.items():
            self._take(name, value, read_object, 0)
        return contents_of_arrays(
            self._arrays,
            variable=variable,
            left_out=tuple(self._notes),
            facts=self._facts,
            texts=self._texts,
            shapes=self._shapes,
        )

    def _take(self, name: str, value: Value, read_object: ReadObject, depth: int) -> None:
        if depth > MAX_DEPTH:
            raise InputError(f"holds structures {MAX_DEPTH} levels deep, so it is not a recording")
        self._parts += 1
        check_parts(self._parts)
        if isinstance(value, str):
            if value and len(value) <= LONGEST_TEXT:
                self._texts[name] = value
        elif isinstance(value, np.ndarray):
            if value.size:
                self._arrays[name] = value
        elif isinstance(value, ArrayPart):
            self._arrays[name], self._shapes[name] = value.values, value.shape
        elif isinstance(value, Unread):
            self._notes.append(not_read(name, f"{value.kind}, which cannot be read; {REMEDY}"))
        elif isinstance(value, ObjectReference):
            self._take_object(name, value, read_object)
        else:
            for end, part in _parts_of(value):
                self._take(f"{name}{end}", part, read_object, depth + 1)

    def _take_object(self, name: str, value: ObjectReference, read_object: ReadObject) -> None:
        try:
            read = read_object(name, value)
        except NotApplicableError as error:
            reason = f" ({error})" if str(error) else ""
            self._notes.append(not_read(name, f"a {value.class_name}, which cannot be read{reason}; {REMEDY}"))
            return
        self._arrays |= read.arrays
        self._facts |= read.facts
        self._texts |= read.texts
        self._notes += read.notes


def _parts_of(value: Cells | Structures) -> list[tuple[str, Value]]:
    """Return the parts of a value, each with the end of its name."""
    if isinstance(value, Cells):
        return [(f"{{{i + 1}}}", item) for i, item in enumerate(value.items)]
    single = len(value.elements) == 1
    return [
        (f"{'' if single else f'({i + 1})'}.{key}", part)
        for i, element in enumerate(value.elements)
        for key, part in element.items()
    ]
