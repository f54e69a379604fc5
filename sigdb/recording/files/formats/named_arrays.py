"""Conversion of the named arrays of MAT, HDF5 and NPZ files to columns."""

import math
from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import InputError, Note, suggestion
from sigdb.recording.files.formats.contents import Contents, DataColumn, StoredArray, check_columns, check_values
from sigdb.recording.files.formats.stated_facts import ArrayFacts, stated_facts
from sigdb.recording.files.formats.stated_rates import rate_of

__all__ = ["SHORTEST", "ArrayFacts", "contents_of_arrays", "not_read", "rate_of"]

SHORTEST = 16
"""Length from which on an array is a signal; shorter arrays are facts about a recording."""


def not_read(name: str, reason: str) -> Note:
    """Return the note that a part of a file is not a channel; ``reason`` completes "NAME is"."""
    return Note(code="not-read", text=f"{name} is {reason}", values={"name": name})


def contents_of_arrays(
    arrays: Mapping[str, StoredArray],
    *,
    variable: str | None = None,
    left_out: tuple[Note, ...] = (),
    facts: Mapping[str, ArrayFacts] | None = None,
    texts: Mapping[str, str] | None = None,
    named: bool = True,
    shapes: Mapping[str, tuple[int, ...]] | None = None,
) -> Contents:
    """Return the columns of all arrays that are long enough; each column of a matrix is a column.

    Parameters
    ----------
    arrays
        Arrays of numbers of any real type, by name; parts of a structure or group come after ``.`` or ``/``.
    variable
        The array, structure or group to take; all of them by default.
    left_out
        Notes on the other parts of the file.
    facts
        Unit, sampling rate and start of those arrays for which the file states them.
    texts
        Short texts of the file by name, such as ``ch1.fs`` where a file holds a rate as text.
    named
        False where the names were made up.
    shapes
        Shapes of the arrays in the file, where ``arrays`` hold some of their samples.
    """
    shapes = {name: values.shape for name, values in arrays.items()} | dict(shapes or {})
    sizes = {name: math.prod(shape) for name, shape in shapes.items()}
    chosen = {name: values for name, values in arrays.items() if variable is None or _inside(name, variable)}
    if not chosen:
        others = "; ".join(note.text for note in left_out[:3])
        if variable is not None and arrays:
            raise InputError(f"holds no numbers named {variable!r}{suggestion(variable, arrays)}")
        raise InputError(f"holds no arrays of numbers{': ' if others else ''}{others}")
    notes = list(left_out if variable is None else ())
    columns: list[DataColumn] = []
    short = {name: values for name, values in chosen.items() if sizes[name] < SHORTEST}
    entries: dict[str, ArrayLike] = {
        **{name: values for name, values in arrays.items() if sizes[name] < SHORTEST}, **(texts or {})
    }  # fmt: skip
    stated = stated_facts(entries, [name for name in arrays if sizes[name] >= SHORTEST])
    for name, values in chosen.items():
        if name not in short:
            of_name = _with_facts((facts or {}).get(name, ArrayFacts()), stated.of_array(name))
            split, split_notes = _columns(name, values, of_name, shapes[name])
            columns += split
            notes += split_notes
    if not columns:
        left = [note.text for note in notes[:3]] + ([f"there are {_listed(short)}"] if short else [])
        raise InputError(f"holds no array of {SHORTEST} numbers or more; {'; '.join(left)}")
    check_columns(len(columns))
    check_values(sum(column.values.size for column in columns))
    too_short = [name for name in short if name not in stated.used]
    if too_short:
        text = f"{_listed(too_short)}: fewer than {SHORTEST} numbers, so not a channel"
        notes.append(Note(code="short-arrays", text=text, values={"arrays": len(too_short)}))
    return Contents(
        columns=tuple(columns), notes=(*notes, *stated.notes), named=named, speed_rpm=stated.speed_rpm
    )  # fmt: skip


def _with_facts(facts: ArrayFacts, stated: ArrayFacts) -> ArrayFacts:
    """Return the facts of an array's attributes, and those of entries around it where the attributes state none."""
    has_rate = facts.sampling_rate is not None
    return ArrayFacts(
        unit=facts.unit or stated.unit,
        sampling_rate=facts.sampling_rate if has_rate else stated.sampling_rate,
        rate_from=facts.rate_from if has_rate else stated.rate_from,
        start=stated.start if facts.start is None else facts.start,
        abscissa=stated.abscissa if facts.abscissa == "time" else facts.abscissa,
    )


def _columns(
    name: str, values: StoredArray, facts: ArrayFacts, shape: tuple[int, ...]
) -> tuple[list[DataColumn], list[Note]]:
    """Return the columns of an array that has this shape in the file, and notes."""
    if values.dtype.kind == "c":
        text = f"{name} holds complex numbers; a channel is real"
        return [], [Note(code="complex-numbers", text=text, values={"name": name})]
    values = np.squeeze(values, tuple(i for i, size in enumerate(shape) if size == 1))
    shape = tuple(size for size in shape if size != 1)
    if values.ndim > 2:
        text = f"{name} of shape {shape} is neither a series nor a matrix of columns, so not a channel"
        return [], [Note(code="neither-series-nor-matrix", text=text, values={"name": name})]
    if values.ndim < 2:
        return [_column(name, values.reshape(-1), facts)], []
    wide = shape[1] > shape[0]
    matrix = values.T if wide else values
    check_columns(matrix.shape[1])
    columns = [_column(f"{name}{i + 1}", matrix[:, i], facts, named=False) for i in range(matrix.shape[1])]
    text = f"{name} of shape {shape} was read with its samples along the rows"
    return columns, [Note(code="samples-along-rows", text=text, values={"name": name})] if wide else []


def _column(name: str, values: StoredArray, facts: ArrayFacts, *, named: bool = True) -> DataColumn:
    return DataColumn(name=name, values=values, named=named, **vars(facts))


def _inside(name: str, variable: str) -> bool:
    return name == variable or name.startswith((f"{variable}.", f"{variable}/", f"{variable}(", f"{variable}{{"))


def _listed(names: Collection[str]) -> str:
    first = list(names)[:8]
    return ", ".join(first) + (" ..." if len(names) > len(first) else "")
