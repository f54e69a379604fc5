"""UFF58: time records in data sets 58 of universal files, as text or binary (58b).

The data set is described by the Structural Dynamics Research Laboratory of the University of Cincinnati, *Universal
File Formats*.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    bounded_bytes,
    check_columns,
    check_parts,
    check_values,
)
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = ()

HEADER = 11
TIME_RESPONSE = (0, 1)
REAL = {2: "f4", 4: "f8"}
DIRECTIONS = {"1": "+X", "2": "+Y", "3": "+Z", "-1": "-X", "-2": "-Y", "-3": "-Z"}


_HERE = re.compile(rb"    -1[ \t]*(?:\r?\n|\Z)")
_LATER = re.compile(rb"(?<=[\r\n])    -1[ \t]*(?:\r?\n|\Z)")


@dataclass(frozen=True, kw_only=True)
class _Set:
    """A data set: its kind, its first line, the lines of its header, and all bytes after them."""

    kind: str
    first: str
    header: tuple[str, ...]
    body: bytes


def read_uff58(path: Path, settings: RecordingSettings) -> Contents:
    """Read each evenly spaced time record as a column, named by the first line of its header or by its node."""
    columns: list[DataColumn] = []
    others: list[str] = []
    total = 0
    for dataset in _sets(bounded_bytes(path)):
        check_parts(len(columns) + len(others))
        if dataset.kind not in ("58", "58b"):
            others.append(f"data set {dataset.kind}")
        elif _whole(dataset.header[5][:5]) not in TIME_RESPONSE:
            others.append(f"function {_name(dataset)} of type {_whole(dataset.header[5][:5])}")
        else:
            columns.append(_column(dataset))
            total += columns[-1].values.size
            check_columns(len(columns))
            check_values(total)
    if not columns:
        raise InputError(f"holds no time record (data set 58 of function type 1){_listed(others)}")
    left_out = Note(code="data-sets-left-out", text=f"left out{_listed(others)}", values={"data_sets": len(others)})
    return Contents(columns=tuple(columns), notes=(left_out,) if others else ())


def _listed(others: list[str]) -> str:
    return f": {', '.join(others[:8])}{' ...' if len(others) > 8 else ''}" if others else ""


def _sets(data: bytes) -> Iterator[_Set]:
    """Yield the data sets between lines of -1; a binary data set states its length."""
    at = 0
    while True:
        start, line = _mark(data, at)
        if start < 0:
            return
        at, first = _line(data, line)
        kind = first[:7].strip()
        header: list[str] = []
        if kind in ("58", "58b"):
            for _ in range(HEADER):
                at, text = _line(data, at)
                header.append(text)
            if len(data) <= at:
                raise InputError("is cut short: a data set 58 ends in its header")
        size = _whole(first[31:43]) if kind == "58b" else 0
        end, after = _mark(data, at + size)
        if end < 0:
            raise InputError(f"is cut short: data set {kind[:8]!r} has no end")
        yield _Set(kind=kind, first=first, header=tuple(header), body=data[at:end] if header else b"")
        at = after


def _mark(data: bytes, at: int) -> tuple[int, int]:
    """Return where the next line of -1 begins and ends; -1 if there is none. A line begins at ``at``."""
    mark = _HERE.match(data, at) or _LATER.search(data, at)
    return mark.span() if mark else (-1, -1)


def _line(data: bytes, at: int) -> tuple[int, str]:
    """Return where the line after the line at ``at`` begins, and the text of the latter."""
    end = data.find(b"\n", at, at + 1000)
    end = min(len(data), at + 1000) if end < 0 else end
    return end + 1, data[at:end].decode("latin-1").rstrip("\r")


def _column(dataset: _Set) -> DataColumn:
    header = dataset.header[6]
    kind, count, even = (_whole(header[i : i + 10]) for i in (0, 10, 20))
    interval = _number(header[43:56] if len(header) > 56 else header[43:])
    name = _name(dataset)
    if kind not in REAL:
        raise InputError(f"{name} holds complex numbers; a time record is real")
    check_values(count)
    pairs = even != 1
    stored = _stored(dataset, kind, count * (2 if pairs else 1), name, pairs=pairs)
    if pairs:
        raise InputError(f"{name} has times that are not evenly spaced; resample it")
    if not (np.isfinite(interval) and interval > 0):
        return DataColumn(name=name, values=stored, unit=_unit(dataset))
    return DataColumn(name=name, values=stored, unit=_unit(dataset), sampling_rate=1 / interval)


def _stored(dataset: _Set, kind: int, count: int, name: str, *, pairs: bool) -> StoredArray:
    if dataset.kind == "58b":
        order = {1: "<", 2: ">"}.get(_whole(dataset.first[7:13]), "")
        if not order or _whole(dataset.first[13:19]) != 2:
            raise InputError(f"{name} is not stored as IEEE numbers")
        size = _whole(dataset.first[31:43])
        values = np.frombuffer(
            dataset.body[:size], order + REAL[kind], min(size, len(dataset.body)) // int(REAL[kind][1])
        )
    else:
        values = _from_text(dataset.body, name)
    if values.size < count:
        raise InputError(f"{name} is cut short: it states {count} numbers and holds {values.size}")
    return values[:count]


def _from_text(body: bytes, name: str) -> StoredArray:
    """Return the numbers between blanks, converted some megabytes at a time."""
    pieces, at = [np.zeros(0)], 0
    while at < len(body):
        end = body.find(b"\n", at + 2**22)
        end = len(body) if end < 0 else end
        try:
            pieces.append(np.array(body[at:end].split(), dtype=float))
        except ValueError:
            raise InputError(f"{name} holds other things than numbers; write the file again") from None
        at = end
    return np.concatenate(pieces)


def _name(dataset: _Set) -> str:
    title = dataset.header[0].strip()
    if title and title.upper() != "NONE":
        return title
    record = dataset.header[5]
    direction = DIRECTIONS.get(record[51:55].strip().lstrip("+"), "")
    return f"node {record[41:51].strip()} {direction}".strip()


def _unit(dataset: _Set) -> str:
    unit = dataset.header[8][47:67].strip()
    return "" if unit.upper() == "NONE" else unit


def _whole(text: str) -> int:
    try:
        number = int(text or "0")
    except ValueError:
        number = -1
    if number < 0:
        raise InputError(f"is damaged: {text[:20]!r} where a number belongs")
    return number


def _number(text: str) -> float:
    try:
        return float(text or "0")
    except ValueError:
        raise InputError(f"is damaged: {text[:20]!r} where a number belongs") from None
