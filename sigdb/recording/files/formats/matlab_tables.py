"""Arrays of MATLAB's objects: columns of tables and timetables, dates, durations and strings."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sigdb.core import NotApplicableError, Note
from sigdb.recording.files.formats.contents import StoredArray, check_columns
from sigdb.recording.files.formats.matlab_objects import ObjectStore
from sigdb.recording.files.formats.matlab_values import (
    LONGEST_TEXT,
    REMEDY,
    Cells,
    ObjectArrays,
    ObjectReference,
    Structures,
    Unread,
    Value,
)
from sigdb.recording.files.formats.named_arrays import ArrayFacts, not_read


def read_object(store: ObjectStore, name: str, reference: ObjectReference) -> ObjectArrays:
    """Return the arrays of an object; those of a table are ``name.column``.

    Durations and dates are read in seconds, dates from the first one on.

    Raises
    ------
    NotApplicableError
        If it is none of these, or the file is damaged there.
    """
    kind = store.class_name(reference)
    if kind == "table":
        return _columns(store, name, _table(store.properties(reference)))
    if kind == "timetable":
        return _columns(store, name, _timetable(store, store.properties(reference)))
    if kind == "string":
        return ObjectArrays(texts={name: _single_string(store.properties(reference))})
    if kind in ("duration", "datetime"):
        return ObjectArrays(arrays={name: _seconds(store, reference)[0]}, facts={name: ArrayFacts(unit="s")})
    raise NotApplicableError("" if kind == reference.class_name else f"it is of the class {kind}")


@dataclass(frozen=True, kw_only=True)
class _Table:
    """Columns of a table by name, with their units. ``times`` or a rate belong to all of them."""

    rows: int
    names: list[str]
    values: tuple[Value, ...]
    units: list[str]
    times: StoredArray | None = None
    first_date: float | None = None
    sampling_rate: float | None = None
    start: float | None = None


def _table(properties: Mapping[str, Value]) -> _Table:
    return _Table(
        rows=_count(properties.get("nrows")),
        names=_texts(properties.get("varnames")),
        values=_cells(properties.get("data")),
        units=_texts(_fields(properties.get("props")).get("VariableUnits")),
    )


def _timetable(store: ObjectStore, properties: Mapping[str, Value]) -> _Table:
    fields = _fields(properties.get("any"))
    rate = start = times = first = None
    stated = fields.get("rowTimes")
    if isinstance(stated, ObjectReference):
        times, first = _seconds(store, stated)
    else:
        rate, start = _regular_times(store, _fields(stated))
    return _Table(
        rows=_count(fields.get("numRows")),
        names=_texts(fields.get("varNames")),
        values=_cells(fields.get("data")),
        units=_texts(fields.get("varUnits")),
        times=times,
        first_date=first,
        sampling_rate=rate,
        start=first or start,
    )


def _regular_times(store: ObjectStore, fields: Mapping[str, Value]) -> tuple[float, float]:
    """Return the sampling rate in Hz and the first time in s of a timetable with a rate or a step."""
    origin, step, rate = fields.get("origin"), fields.get("stepSize"), fields.get("sampleRate")
    if not isinstance(origin, ObjectReference) or not isinstance(step, ObjectReference):
        raise NotApplicableError("its row times are damaged")
    relative, first = _seconds(store, origin)
    if relative.size != 1:
        raise NotApplicableError("its row times are damaged")
    by_rate = bool(_number(fields.get("specifiedAsRate")))
    hertz = _number(rate) if by_rate else 1 / max(_number(_seconds(store, step)[0]), 1e-300)
    if not (np.isfinite(hertz) and hertz > 0):
        raise NotApplicableError("its time step is no number of seconds")
    return hertz, float(relative.reshape(-1)[0]) + first


def _columns(store: ObjectStore, name: str, table: _Table) -> ObjectArrays:
    if len(table.names) != len(table.values):
        raise NotApplicableError(f"it has {len(table.names)} names and {len(table.values)} columns")
    arrays: dict[str, StoredArray] = {}
    facts: dict[str, ArrayFacts] = {}
    notes: list[Note] = []
    if table.times is not None:
        times_name = f"{name}.Time" if "Time" not in table.names else f"{name}.row times"
        arrays[times_name] = table.times.reshape(-1)
        facts[times_name] = ArrayFacts(unit="s")
    if table.first_date:
        notes.append(_date_note(name, table.first_date))
    units = table.units + [""] * len(table.names)
    for key, value, unit in zip(table.names, table.values, units, strict=False):
        column, seconds, kind = _column(store, value)
        if column is None:
            notes.append(not_read(f"{name}.{key}", f"{kind}, which cannot be read; {REMEDY}"))
            continue
        if column.shape[0] != table.rows or column.ndim > 2:
            raise NotApplicableError(f"its column {key} has the shape {column.shape}, the table has {table.rows} rows")
        width = int(np.prod(column.shape[1:], dtype=object))
        check_columns(width)
        for i in range(width):
            full = f"{name}.{key}" if width == 1 else f"{name}.{key}{i + 1}"
            arrays[full] = column[:, i]
            facts[full] = ArrayFacts(
                unit="s" if seconds else unit,
                sampling_rate=table.sampling_rate,
                rate_from=f"the row times of {name}",
                start=table.start,
            )
    return ObjectArrays(arrays=arrays, facts=facts, notes=tuple(notes))


def _date_note(name: str, first: float) -> Note:
    at = np.datetime64(round(min(first, 1e13)), "s") if abs(first) < 1e13 else "an unknown date"
    text = f"{name}: its times are in s after {at}"
    return Note(code="times-after-date", text=text, values={"name": name, "first": first})


def _column(store: ObjectStore, value: Value) -> tuple[StoredArray | None, bool, str]:
    """Return the numbers of a column, None if it has none; whether they are seconds; and the kind of its value."""
    if isinstance(value, np.ndarray):
        return value, False, ""
    if isinstance(value, ObjectReference):
        kind = store.class_name(value)
        return (_seconds(store, value)[0], True, "") if kind in ("duration", "datetime") else (None, False, f"a {kind}")
    if isinstance(value, Unread):
        return None, False, value.kind
    kinds = {Cells: "a cell array", Structures: "a structure"}
    return None, False, kinds.get(type(value), "text")


def _seconds(store: ObjectStore, reference: ObjectReference) -> tuple[StoredArray, float]:
    """Return durations in s; or dates in s after the first of them, and the first in s after 1970."""
    properties = store.properties(reference)
    kind = store.class_name(reference)
    stored = properties.get({"duration": "millis", "datetime": "data"}.get(kind, ""))
    if not isinstance(stored, np.ndarray) or stored.dtype.kind not in "fc":
        raise NotApplicableError(f"it holds a {kind} without numbers of seconds")
    if kind == "duration":
        return np.real(stored) / 1000, 0.0
    # Dates are milliseconds; the imaginary part holds what the real part cannot.
    first = stored.reshape(-1, order="F")[:1]
    if not first.size:
        return np.real(stored), 0.0
    later = (stored.real - first.real) + (stored.imag - first.imag)
    return later / 1000, float(first.real[0] + first.imag[0]) / 1000


def _single_string(properties: Mapping[str, Value]) -> str:
    """Return the text of an array of one string: version, number of dimensions, dimensions, length, UTF-16."""
    stored = properties.get("any")
    words = stored.reshape(-1, order="F") if isinstance(stored, np.ndarray) else np.zeros(0)
    if words.dtype != np.uint64 or words.size < 5 or words[:4].tolist() != [1, 2, 1, 1]:
        raise NotApplicableError("it is no single text")
    length = int(words[4])
    if length > LONGEST_TEXT:
        return ""
    codes = words[5:].astype("<u8").view("<u2")[:length]
    return codes.tobytes().decode("utf-16-le", "replace")


def _count(value: Value | None) -> int:
    number = _number(value)
    if not (number >= 0 and number == int(number)):
        raise NotApplicableError("its number of rows is damaged")
    return int(number)


def _number(value: Value | None) -> float:
    if not isinstance(value, np.ndarray) or value.size != 1 or value.dtype.kind not in "biuf":
        raise NotApplicableError("a number of it is damaged")
    number = float(value.reshape(-1)[0])
    return number if abs(number) < 1e300 else float("nan")


def _fields(value: Value | None) -> Mapping[str, Value]:
    if not isinstance(value, Structures) or len(value.elements) != 1:
        raise NotApplicableError("its properties are of a version that is not known")
    return value.elements[0]


def _cells(value: Value | None) -> tuple[Value, ...]:
    return value.items if isinstance(value, Cells) else ()


def _texts(value: Value | None) -> list[str]:
    return [text if isinstance(text, str) else "" for text in _cells(value)]
