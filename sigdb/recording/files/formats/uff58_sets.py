"""Data sets of universal files, and the records at the head of a data set 58.

The data sets are described by the Structural Dynamics Research Laboratory of the University of Cincinnati, *Universal
File Formats*.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from sigdb.core import InputError

HEADER = 11
DIRECTIONS = {1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}
LENGTHS = {1: "m", 2: "ft", 3: "m", 4: "ft", 5: "mm", 6: "cm", 7: "in", 8: "mm", 10: "mm"}
PER_METRE = {"m": 1.0, "ft": 3.28084, "mm": 1000.0, "cm": 100.0, "in": 39.3701}
PER_SECOND = {8: "", 11: "/s", 12: "/s^2"}
"""End of the unit of a displacement, a velocity and an acceleration."""

_INDENTED = re.compile(rb"    -1[ \t]*(?:\r?\n|\Z)"), re.compile(rb"(?<=[\r\n])    -1[ \t]*(?:\r?\n|\Z)")
_ANY_INDENT = re.compile(rb"[ \t]*-1[ \t]*(?:\r?\n|\Z)"), re.compile(rb"(?<=[\r\n])[ \t]*-1[ \t]*(?:\r?\n|\Z)")


@dataclass(frozen=True, kw_only=True)
class DataSet:
    """A data set: its kind, its first line, the lines of its header, and all bytes after them."""

    kind: str
    first: str
    header: tuple[str, ...]
    body: bytes

    @cached_property
    def function_type(self) -> int:
        """Type of the function: 0 general, 1 time response, 2 auto spectrum, and so on."""
        return whole(self.header[5][:5])

    @cached_property
    def title(self) -> str:
        """First line of the header; empty for NONE."""
        return stated(self.header[0])

    @cached_property
    def place(self) -> str:
        """Entity, node and direction of the response."""
        record = self.header[5]
        code = whole(record[51:55].strip().lstrip("+-"))
        sign = "-" if record[51:55].strip().startswith("-") else "+"
        direction = DIRECTIONS.get(code, "+")[1:]
        entity = stated(record[31:41])
        return f"{entity or 'node'} {record[41:51].strip()} {direction and sign + direction}".strip()

    @cached_property
    def size(self) -> int:
        """Bytes of the numbers of a binary data set."""
        return whole(self.first[31:43]) if self.kind == "58b" else 0

    def axis(self, record: int) -> tuple[int, str, str]:
        """Return the kind of data (17 time, 18 frequency, ...), the label and the unit of an axis, records 8 to 11."""
        line = self.header[record - 1]
        return whole(line[:10]), stated(line[26:46]), stated(line[47:67])


def data_sets(data: bytes) -> Iterator[DataSet]:
    """Yield the data sets between lines of -1; a binary data set states its length.

    The lines of -1 have an indent of four signs; in a file whose first line has none, any indent will do.
    """
    begin = data[:100].lstrip(b"\r\n")
    marks = _INDENTED if begin.startswith(b"    -1") else _ANY_INDENT
    at = 0
    while True:
        start, line = _mark(marks, data, at)
        if start < 0:
            return
        at, first = _line(data, line)
        first = _with_indent(first, 6)
        kind = first[:7].strip()
        header: list[str] = []
        if kind in ("58", "58b"):
            for record in range(HEADER):
                at, text = _line(data, at)
                header.append(_with_indent(text, {5: 5}.get(record, 10)) if record >= 5 else text)
            if len(data) <= at:
                raise InputError("is cut short: a data set 58 ends in its header")
        size = whole(first[31:43]) if kind == "58b" else 0
        end, after = _mark(marks, data, at + size)
        if end < 0:
            raise InputError(f"is cut short: data set {kind[:8]!r} has no end")
        yield DataSet(
            kind=kind, first=first, header=tuple(header), body=data[at:end] if header or kind == "164" else b""
        )
        at = after


def _mark(marks: tuple[re.Pattern[bytes], re.Pattern[bytes]], data: bytes, at: int) -> tuple[int, int]:
    """Return where the next line of -1 begins and ends; -1 if there is none. A line begins at ``at``."""
    mark = marks[0].match(data, at) or marks[1].search(data, at)
    return mark.span() if mark else (-1, -1)


def _line(data: bytes, at: int) -> tuple[int, str]:
    """Return where the line after the line at ``at`` begins, and the text of the latter."""
    end = data.find(b"\n", at, at + 1000)
    end = min(len(data), at + 1000) if end < 0 else end
    return end + 1, _decoded(data[at:end]).rstrip("\r")


def _decoded(line: bytes) -> str:
    """Return a line of UTF-8, or else of Windows' western encoding; a field's width counts signs."""
    try:
        return line.decode()
    except UnicodeDecodeError:
        return line.decode("cp1252", "replace")


def _with_indent(line: str, width: int) -> str:
    """Return a line whose first whole number ends where its field of that width ends, though its indent was cut off."""
    first = re.match(r"[+-]?\d+", line)
    return " " * (width - first.end()) + line if first and first.end() < width else line


def length_unit(data_set: DataSet) -> str:
    """Return the unit of length that a data set 164 states by its code and its factor; empty if they do not agree."""
    lines = data_set.body.decode("latin-1").splitlines()
    if len(lines) < 2:
        return ""
    factor = lines[1].replace("D", "E").replace("d", "e").strip()[:25].split()
    try:
        code, per_metre = int(lines[0][:10]), float(factor[0])
    except (ValueError, IndexError):
        return ""
    unit = next((unit for unit, value in PER_METRE.items() if abs(per_metre - value) < 1e-4 * value), "")
    return unit if unit == LENGTHS.get(code, unit) else ""


def stated(text: str) -> str:
    """Return a text of a record; empty for NONE."""
    text = text.strip()
    return "" if text.upper() == "NONE" else text


def whole(text: str) -> int:
    """Return a count or a code of a record."""
    try:
        number = int(text.strip() or "0")
    except ValueError:
        number = -1
    if number < 0:
        raise InputError(f"is damaged: {text[:20]!r} where a number belongs")
    return number


def real(text: str) -> float:
    """Return a real number of a record."""
    try:
        return float(text.strip() or "0")
    except ValueError:
        raise InputError(f"is damaged: {text[:20]!r} where a number belongs") from None
