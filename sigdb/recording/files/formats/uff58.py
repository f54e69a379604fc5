"""Universal files: time records in data sets 58, as text or binary (58b).

The data set is described by the Structural Dynamics Research Laboratory of the University of Cincinnati, *Universal
File Formats*.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
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
    """Kind of a data set, its first line, the lines of its header, and all bytes after them."""

    kind: str
    first: str
    header: tuple[str, ...]
    body: bytes


def read_uff58(path: Path, settings: RecordingSettings) -> Contents:
    """A channel for each evenly spaced time record; its name is the first line of the header, or node and direction."""
    columns: list[DataColumn] = []
    others: list[str] = []
    total = 0
    for one in _sets(bounded_bytes(path)):
        check_parts(len(columns) + len(others))
        if one.kind not in ("58", "58b"):
            others.append(f"data set {one.kind}")
        elif _whole(one.header[5][:5]) not in TIME_RESPONSE:
            others.append(f"function {_name(one)} of type {_whole(one.header[5][:5])}")
        else:
            columns.append(_column(one))
            total += columns[-1].values.size
            check_columns(len(columns))
            check_values(total)
    if not columns:
        raise InputError(f"holds no time record (data set 58 of function type 1){_told(others)}")
    return Contents(columns=tuple(columns), notes=(f"left out{_told(others)}",) if others else ())


def _told(others: list[str]) -> str:
    return f": {', '.join(others[:8])}{' ...' if len(others) > 8 else ''}" if others else ""


def _sets(data: bytes) -> Iterator[_Set]:
    """Data sets between lines of -1; a binary one says how long it is."""
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
    """Where the next line of -1 begins and where it ends; -1 if there is none. A line begins at ``at``."""
    found = _HERE.match(data, at) or _LATER.search(data, at)
    return found.span() if found else (-1, -1)


def _line(data: bytes, at: int) -> tuple[int, str]:
    """Where the line after the one at ``at`` begins, and its text."""
    end = data.find(b"\n", at, at + 1000)
    end = min(len(data), at + 1000) if end < 0 else end
    return end + 1, data[at:end].decode("latin-1").rstrip("\r")


def _column(one: _Set) -> DataColumn:
    header = one.header[6]
    kind, count, even = (_whole(header[i : i + 10]) for i in (0, 10, 20))
    interval = _number(header[43:56] if len(header) > 56 else header[43:])
    name = _name(one)
    if kind not in REAL:
        raise InputError(f"{name} holds complex numbers; a time record is real")
    check_values(count)
    pairs = even != 1
    stored = _stored(one, kind, count * (2 if pairs else 1), name, pairs=pairs)
    if pairs:
        raise InputError(f"{name} has times that are not evenly spaced; resample it")
    if not (np.isfinite(interval) and interval > 0):
        return DataColumn(name=name, values=stored, unit=_unit(one))
    return DataColumn(name=name, values=stored, unit=_unit(one), sampling_rate=1 / interval)


def _stored(one: _Set, kind: int, count: int, name: str, *, pairs: bool) -> np.ndarray[Any, Any]:
    if one.kind == "58b":
        order = {1: "<", 2: ">"}.get(_whole(one.first[7:13]), "")
        if not order or _whole(one.first[13:19]) != 2:
            raise InputError(f"{name} is not stored as IEEE numbers")
        size = _whole(one.first[31:43])
        values = np.frombuffer(one.body[:size], order + REAL[kind], min(size, len(one.body)) // int(REAL[kind][1]))
    else:
        values = _from_text(one.body, name)
    if values.size < count:
        raise InputError(f"{name} is cut short: it says {count} numbers and holds {values.size}")
    return values[:count]


def _from_text(body: bytes, name: str) -> np.ndarray[Any, Any]:
    """Numbers between blanks, some megabytes at a time."""
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


def _name(one: _Set) -> str:
    told = one.header[0].strip()
    if told and told.upper() != "NONE":
        return told
    record = one.header[5]
    direction = DIRECTIONS.get(record[51:55].strip().lstrip("+"), "")
    return f"node {record[41:51].strip()} {direction}".strip()


def _unit(one: _Set) -> str:
    told = one.header[8][47:67].strip()
    return "" if told.upper() == "NONE" else told


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
