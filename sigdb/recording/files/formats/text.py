"""Tables of numbers in text: CSV, TXT and similar files, plain or gzipped."""

import io
import re
import zlib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.contents import (
    FREE_BYTES,
    MAX_BYTES,
    MAX_RATIO,
    Contents,
    DataColumn,
    bounded_bytes,
    check_columns,
    check_ratio,
    check_values,
)
from sigdb.recording.files.settings import RecordingSettings

SAMPLE_LINES = 200
"""Number of lines in which the beginning of a table is searched."""

LONGEST_NUMBER = 64
"""Largest number of characters of a number."""

MISSING = ("", "nan", "na", "n/a", "#n/a", "null", "none", "-", "-nan", "1.#qnan", "-1.#ind", "1.#ind")

_NUMBER = {
    ".": re.compile(r'"?[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?"?|[+-]?inf(inity)?', re.IGNORECASE),
    ",": re.compile(r'"?[+-]?\d*(,\d+|\d)([eEdD][+-]?\d+)?"?|[+-]?inf(inity)?', re.IGNORECASE),
}
_CLOCK = re.compile(r'"?(\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})?[ T]?(\d{1,2}:\d{2}(:\d{2})?([.,]\d+)?)?Z?"?')
_SEPARATORS = (("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (" ", "."), (" ", ","))
_WORDS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "blanks"}


@dataclass(frozen=True, kw_only=True)
class TextLayout:
    """Layout of a table of numbers in a text.

    Attributes
    ----------
    separator, decimal
        Sign between numbers, and decimal sign.
    first
        Number of lines before the numbers.
    columns
        Number of columns.
    names, units
        Names and units of the columns; None where the text states none.
    clocks
        Positions of the columns that hold dates or clock times.
    notes
        Notes on the format and on lines that are left out.
    """

    separator: str
    decimal: str
    first: int
    columns: int
    names: tuple[str, ...] | None
    units: tuple[str, ...] | None
    clocks: tuple[int, ...]
    notes: tuple[Note, ...]


def text_layout(lines: list[str], *, separator: str | None, decimal: str | None) -> TextLayout:
    """Find the table in the first lines of a text.

    Raises
    ------
    InputError
        If there is none, or it can be read in two ways.
    """
    ways = [(s, d) for s, d in _SEPARATORS if separator in (None, s) and decimal in (None, d)] or [
        (separator or ",", decimal or ".")
    ]
    tables = [table for s, d in ways if (table := _table(lines, s, d)) is not None]
    if not tables:
        shown = next((line for line in lines if line.strip()), "")[:60]
        raise InputError(f"holds no table of numbers in its first {SAMPLE_LINES} lines; the first is {shown!r}")
    _, columns, _, first, s, d = max(tables)
    fields = split(lines[first], s)
    _refuse_ragged(lines, first, columns, s, d)
    if separator is None and decimal is None and s == "," and columns == 2:
        _refuse_ambiguous(lines, first)
    names, units, used = _header(lines[:first], s, columns)
    skipped = [line for line in lines[: first - used] if line.strip()]
    notes = []
    if skipped:
        text = f"{len(skipped)} lines before the table were left out"
        notes.append(Note(code="lines-left-out", text=text, values={"lines": len(skipped)}))
    if (s, d) != (",", "."):
        text = f"read with {_WORDS[s]} between numbers and decimal {'comma' if d == ',' else 'point'}"
        notes.append(Note(code="text-format", text=text, values={"separator": s, "decimal": d}))
    clocks = tuple(i for i, field in enumerate(fields) if _is_clock(field) and not _is_number(field, d))
    return TextLayout(
        separator=s, decimal=d, first=first, columns=columns, names=names, units=units, clocks=clocks,
        notes=tuple(notes),
    )  # fmt: skip


def split(line: str, separator: str) -> list[str]:
    """Return the fields of a line without the blanks around them; a run of blanks is one separator."""
    return line.split() if separator == " " else [field.strip() for field in line.rstrip("\r\n").split(separator)]


def is_row(line: str, layout: TextLayout) -> bool:
    """Return whether a line is a whole row of the table."""
    fields = split(line, layout.separator)
    return len(fields) == layout.columns and _numeric(fields, layout.decimal)


def _table(lines: list[str], separator: str, decimal: str) -> tuple[int, int, int, int, str, str] | None:
    """Return the count of rows of one width, the width, the rank of the signs, the first line, and the signs."""
    rows = [(i, split(line, separator)) for i, line in enumerate(lines) if line.strip()]
    numeric = [(i, fields) for i, fields in rows if _numeric(fields, decimal)]
    widths = [len(fields) for _, fields in numeric]
    starts = [k for k, (width, following) in enumerate(pairwise(widths)) if width == following] or list(
        range(len(widths))
    )[:1]
    if not starts:
        return None
    k = starts[0]
    alike = sum(width == widths[k] for width in widths[k:])
    rank = -_SEPARATORS.index((separator, decimal)) if (separator, decimal) in _SEPARATORS else 0
    return alike, widths[k], rank, numeric[k][0], separator, decimal


def _numeric(fields: list[str], decimal: str) -> bool:
    numbers = [_is_number(field, decimal) for field in fields]
    return any(numbers) and all(
        number or field.strip('"').lower() in MISSING or _is_clock(field)
        for number, field in zip(numbers, fields, strict=True)
    )


def _is_number(field: str, decimal: str) -> bool:
    return len(field) <= LONGEST_NUMBER and _NUMBER[decimal].fullmatch(field) is not None


def _is_clock(field: str) -> bool:
    return any(mark in field for mark in ":-/.") and len(field) > 6 and _CLOCK.fullmatch(field) is not None


def _refuse_ragged(lines: list[str], first: int, columns: int, separator: str, decimal: str) -> None:
    for i, line in enumerate(lines[:first]):
        fields = split(line, separator)
        if len(fields) > 1 and all(_is_number(field, decimal) for field in fields):
            raise InputError(f"line {i + 1} has {len(fields)} numbers, later lines have {columns}; mend or remove it")


def _refuse_ambiguous(lines: list[str], first: int) -> None:
    """Refuse two integers around a comma, which may be a single number with a decimal comma."""
    rows = [split(line, ",") for line in lines[first:] if line.strip()]
    header = first > 0 and len(split(lines[first - 1], ",")) == 2
    digits = all(len(row) == 2 and row[1].isdigit() for row in rows)
    if digits and not header and any("." not in field for row in rows for field in row):
        raise InputError(
            f"line {first + 1}, {lines[first].strip()[:40]!r}, is two integers or one number with a decimal comma; "
            "give decimal='.' or decimal=','"
        )


def _header(
    lines: list[str], separator: str, columns: int
) -> tuple[tuple[str, ...] | None, tuple[str, ...] | None, int]:
    """Return names and units of columns from the lines just above the table, and the number of those lines."""
    above = [line.strip().lstrip("#%").strip() if separator != "\t" else line.lstrip("#%") for line in lines[-2:]]
    fields = [[field.strip('"') for field in split(line, separator)] for line in above if line.strip()]
    if len(fields) != len(above) or not fields:
        fields = fields[-1:] if above and above[-1].strip() else []
    if not fields:
        return None, None, 0
    if len(fields[-1]) != columns:
        if len(fields[-1]) > 1 and separator != " ":
            raise InputError(
                f"line {len(lines)} names {len(fields[-1])} columns, the lines below have {columns} numbers; "
                "mend it, or give separator and decimal"
            )
        return None, None, 0
    if len(fields) == 2 and len(fields[0]) == columns and all(fields[0]) and _are_units(fields[1]):
        return tuple(fields[0]), tuple(field.strip("[]()") for field in fields[1]), 2
    return tuple(fields[-1]), None, 1


def _are_units(fields: list[str]) -> bool:
    """Return whether at least one of the words is a unit."""
    units = {"s", "ms", "us", "v", "mv", "g", "mm/s", "m/s", "m/s2", "m/s^2", "m/s²", "m/s**2", "mm", "um", "pa", "n"}
    return any(field.strip("[]()").lower() in units for field in fields)


FOREIGN: tuple[type[Exception], ...] = (zlib.error,)

FIRST_BYTES = 2**20
"""Number of bytes in which a table must begin; also the longest line."""

LONGEST_LINE = 2**16
"""Bytes of a line in which the beginning of a table is searched."""

_UTF16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
_UNIT = re.compile(r"(.*\S)\s*[\[(]([^\[\]()]{1,20})[\])]")


def read_text(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of a table of numbers; ``name [unit]`` and a line of units are understood."""
    data = plain_text(bounded_bytes(path))
    lines = [line[:LONGEST_LINE].decode("utf-8", "replace") for line in _first_lines(data)]
    layout = text_layout(lines, separator=settings.separator, decimal=settings.decimal)
    check_columns(layout.columns)
    check_values(layout.columns * (data.count(b"\n") + 1 - layout.first))
    table, cut = _without_torn_line(_below(data, layout.first), layout)
    columns = _columns(_named(layout), _parsed(table, layout), layout)
    return Contents(columns=columns, notes=(*layout.notes, *cut, *_clock_notes(layout)), named=layout.names is not None)


def plain_text(data: bytes) -> bytes:
    """Return text without compression, byte order mark and foreign line ends."""
    if data[:2] == b"\x1f\x8b":
        data = _gunzipped(data)
    if data[:2] in _UTF16:
        data = data[2:].decode(_UTF16[data[:2]], "replace").encode()
    data = data.removeprefix(b"\xef\xbb\xbf")
    if not data.strip():
        raise InputError("is empty")
    if b"\0" in data[:65536]:
        raise InputError("is not text: it holds zero bytes")
    return data if b"\n" in data else data.replace(b"\r", b"\n")


def _gunzipped(data: bytes) -> bytes:
    """Return the text of all members of a gzip file, as far as the limits allow."""
    most = min(MAX_BYTES, max(FREE_BYTES, MAX_RATIO * len(data)))
    parts: list[bytes] = []
    size, rest = 0, data
    while rest[:2] == b"\x1f\x8b":
        member = zlib.decompressobj(wbits=31)
        parts.append(member.decompress(rest, most - size + 1))
        size += len(parts[-1])
        check_ratio(size, len(data))
        if size > most:
            raise InputError(f"expands to more than {most} bytes; cut it into shorter recordings")
        if not member.eof:
            raise InputError("ends in the middle of its gzip data; copy it again")
        rest = member.unused_data
    return b"".join(parts)


def _first_lines(data: bytes) -> list[bytes]:
    lines = data[:FIRST_BYTES].split(b"\n", SAMPLE_LINES)[:SAMPLE_LINES]
    return lines[:-1] if len(lines) > 1 and len(data) > FIRST_BYTES else lines


def _below(data: bytes, lines: int) -> bytes:
    start = 0
    for _ in range(lines):
        start = data.index(b"\n", start) + 1
    return data[start:]


def _without_torn_line(table: bytes, layout: TextLayout) -> tuple[bytes, tuple[Note, ...]]:
    """Return the table without a last line that a recorder did not finish."""
    if table.endswith(b"\n"):
        return table, ()
    whole, end, last = table.rpartition(b"\n")
    if not end or not last.strip() or len(last) > FIRST_BYTES or is_row(last.decode("utf-8", "replace"), layout):
        return table, ()
    return whole + end, (Note(code="last-line-left-out", text="the last line is not whole and was left out"),)


def _parsed(table: bytes, layout: TextLayout) -> dict[str, FloatArray]:
    import pyarrow as pa
    from pyarrow import csv

    _refuse_foreign_signs(table, layout)
    if layout.separator == " ":
        table = re.sub(rb"(?m)^\t|\t?\r?$", b"", re.sub(rb"[ \t]+", b"\t", table))
    names = [str(i) for i in range(layout.columns)]
    ragged: list[tuple[int, int]] = []

    def note(row: "csv.InvalidRow") -> str:
        ragged.append((row.number or 0, row.actual_columns))
        return "error"

    try:
        read = csv.read_csv(
            io.BytesIO(table),
            read_options=csv.ReadOptions(column_names=names, use_threads=False),
            parse_options=csv.ParseOptions(
                delimiter="\t" if layout.separator == " " else layout.separator, invalid_row_handler=note
            ),
            convert_options=csv.ConvertOptions(
                column_types={name: pa.string() if int(name) in layout.clocks else pa.float64() for name in names},
                decimal_point=layout.decimal,
                null_values=[spelt for word in MISSING for spelt in {word, word.upper(), word.capitalize(), "NaN"}],
            ),
        )
    except pa.ArrowInvalid as error:
        if ragged:
            number, width = ragged[0]
            raise InputError(
                f"line {number + layout.first} has {width} columns, others have {layout.columns}; mend or remove it"
            ) from None
        raise InputError(_with_line(str(error), layout)) from None
    return {name: read.column(name).to_numpy() for name in names if int(name) not in layout.clocks}


def _refuse_foreign_signs(table: bytes, layout: TextLayout) -> None:
    if not table.isascii():
        at = next(re.finditer(rb"[\x80-\xff]", table)).start()
        line = table[table.rfind(b"\n", 0, at) + 1 : at + 20].split(b"\n")[0].decode("utf-8", "replace")
        number = layout.first + table.count(b"\n", 0, at) + 1
        raise InputError(f"line {number}, {line[-40:]!r}, is not all numbers; mend it")


def _with_line(message: str, layout: TextLayout) -> str:
    cell = re.search(r"In CSV column #(\d+): (?:Row #(\d+): )?.*invalid value '(.*)'", message, re.DOTALL)
    if cell is None:
        return f"is not a table of numbers ({message})"
    line = f"line {int(cell[2]) + layout.first}, " if cell[2] else ""
    return f"{line}column {int(cell[1]) + 1}: {cell[3][:40]!r} is not a number; mend it, or leave it empty"


def _named(layout: TextLayout) -> list[tuple[str, str]]:
    """Return the name and unit of each column."""
    names = layout.names or tuple(f"column{i + 1}" for i in range(layout.columns))
    units = layout.units or ("",) * layout.columns
    return [
        (match[1], match[2].strip()) if not unit and (match := _UNIT.fullmatch(name[:200])) else (name, unit)
        for name, unit in zip(names, units, strict=True)
    ]


def _columns(named: list[tuple[str, str]], values: dict[str, FloatArray], layout: TextLayout) -> tuple[DataColumn, ...]:
    """Return the columns of numbers; an empty field behind a last separator is no column."""
    kept = [i for i in range(layout.columns) if str(i) in values]
    if len(kept) > 1 and not named[kept[-1]][0].strip() and np.isnan(values[str(kept[-1])]).all():
        kept = kept[:-1]
    return tuple(
        DataColumn(name=named[i][0] or f"column{i + 1}", unit=named[i][1], values=values[str(i)]) for i in kept
    )


def _clock_notes(layout: TextLayout) -> tuple[Note, ...]:
    names = [_named(layout)[i][0] for i in layout.clocks]
    return tuple(
        Note(
            code="clock-column-left-out",
            text=f"{name} holds dates or clock times and was left out",
            values={"column": name},
        )
        for name in names
    )
