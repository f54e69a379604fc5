"""Where the numbers of a text file begin, what stands between them, and what the lines before say."""

import re
from dataclasses import dataclass
from itertools import pairwise

from sigdb.core.errors import InputError

SAMPLE_LINES = 200
"""A table that begins later than this is not found."""

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
    """How a table of numbers stands in a text.

    ``first`` is the number of lines before the numbers, ``clocks`` the places of columns of dates or clock times.
    """

    separator: str
    decimal: str
    first: int
    columns: int
    names: tuple[str, ...] | None
    units: tuple[str, ...] | None
    clocks: tuple[int, ...]
    notes: tuple[str, ...]


def text_layout(lines: list[str], *, separator: str | None, decimal: str | None) -> TextLayout:
    """Find the table in the first lines of a text.

    Raises
    ------
    InputError
        If there is none, or it can be read in two ways.
    """
    ways = [
        (s, d)
        for s, d in _SEPARATORS
        if separator in (None, s) and decimal in (None, d)
    ] or [(separator or ",", decimal or ".")]
    found = [table for s, d in ways if (table := _table(lines, s, d)) is not None]
    if not found:
        shown = next((line for line in lines if line.strip()), "")[:60]
        raise InputError(f"holds no table of numbers in its first {SAMPLE_LINES} lines; the first says {shown!r}")
    rows, columns, _, first, s, d = max(found)
    fields = split(lines[first], s)
    _refuse_ragged(lines, first, columns, s, d)
    if separator is None and decimal is None and s == "," and columns == 2:
        _refuse_ambiguous(lines, first)
    names, units, used = _header(lines[:first], s, columns)
    skipped = [line for line in lines[: first - used] if line.strip()]
    notes = [f"{len(skipped)} lines before the table were left out"] if skipped else []
    if (s, d) != (",", "."):
        notes.append(f"read with {_WORDS[s]} between numbers and decimal {'comma' if d == ',' else 'point'}")
    clocks = tuple(i for i, field in enumerate(fields) if _is_clock(field) and not _is_number(field, d))
    return TextLayout(
        separator=s, decimal=d, first=first, columns=columns, names=names, units=units, clocks=clocks,
        notes=tuple(notes),
    )  # fmt: skip


def split(line: str, separator: str) -> list[str]:
    """Fields of a line, without the blanks around them; a run of blanks is one separator."""
    return line.split() if separator == " " else [field.strip() for field in line.rstrip("\r\n").split(separator)]


def is_row(line: str, layout: TextLayout) -> bool:
    """Whether a line is a whole row of the table."""
    fields = split(line, layout.separator)
    return len(fields) == layout.columns and _numeric(fields, layout.decimal)


def _table(lines: list[str], separator: str, decimal: str) -> tuple[int, int, int, int, str, str] | None:
    """Rows in the first that are alike, columns, rank of the way, first line, and the way itself."""
    rows = [(i, split(line, separator)) for i, line in enumerate(lines) if line.strip()]
    numeric = [(i, fields) for i, fields in rows if _numeric(fields, decimal)]
    widths = [len(fields) for _, fields in numeric]
    starts = [k for k, (one, other) in enumerate(pairwise(widths)) if one == other] or list(range(len(widths)))[:1]
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
    return _NUMBER[decimal].fullmatch(field) is not None


def _is_clock(field: str) -> bool:
    return any(mark in field for mark in ":-/.") and len(field) > 6 and _CLOCK.fullmatch(field) is not None


def _refuse_ragged(lines: list[str], first: int, columns: int, separator: str, decimal: str) -> None:
    for i, line in enumerate(lines[:first]):
        fields = split(line, separator)
        if len(fields) > 1 and all(_is_number(field, decimal) for field in fields):
            raise InputError(f"line {i + 1} has {len(fields)} numbers, later lines have {columns}; mend or remove it")


def _refuse_ambiguous(lines: list[str], first: int) -> None:
    """Two integers between which a comma stands may be one number with a decimal comma."""
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
    """Names and units of columns from the lines just above the table, and how many lines those are."""
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
    """Short words, at least one of which is a unit and nothing else."""
    known = {"s", "ms", "us", "v", "mv", "g", "mm/s", "m/s", "m/s2", "m/s^2", "m/s²", "m/s**2", "mm", "um", "pa", "n"}
    return any(field.strip("[]()").lower() in known for field in fields)
