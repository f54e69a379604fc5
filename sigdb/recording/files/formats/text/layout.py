"""Layout of a table of numbers in a text: its separator, decimal sign, first row and kinds of columns."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from sigdb.core import InputError
from sigdb.recording.files.formats.text.fields import (
    CLOCKS,
    FLAG,
    GROUPED,
    MISSING,
    NUMBER,
    OVERLOAD,
    WORD,
    is_count,
    kinds_of,
    split,
)

SAMPLE_LINES = 200
"""Number of lines in which a table is searched first."""

MOST_LINES = 6000
"""Largest number of lines in which the beginning of a table is searched."""

_SEPARATORS = (("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), (" ", "."), (" ", ","), (",", ","))
_QUOTED_COMMA = re.compile(r'"[+-]?[0-9]*,[0-9]+([eE][+-]?[0-9]+)?"')
_SHORTEST_MIXED = 8
_MOSTLY = 0.9


@dataclass(frozen=True, kw_only=True)
class TextLayout:
    """Layout of a table of numbers in a text.

    Attributes
    ----------
    separator, decimal
        Sign between numbers, and decimal sign.
    first
        Number of lines before the first row.
    kinds
        Kind of each column, a letter for each: number, missing, date, time, flag or word.
    grouped
        Whether numbers have marks of thousands.
    side_columns
        Number of leading columns that hold facts in the first rows.
    numbered
        Whether the line above the first row numbers the columns.
    mixed
        Whether the table was found by columns of numbers among columns of words.
    """

    separator: str
    decimal: str
    first: int
    kinds: str
    grouped: bool = False
    side_columns: int = 0
    numbered: bool = False
    mixed: bool = False

    @property
    def columns(self) -> int:
        """Number of columns."""
        return len(self.kinds)


@dataclass(frozen=True, kw_only=True)
class _Rows:
    """Lines of a text, split in one way, with the width of the rows among them."""

    separator: str
    decimal: str
    lines: list[tuple[int, list[str], str]]
    width: int
    rows: int
    loose: bool = False

    def rank(self) -> tuple[int, bool, bool, int, int]:
        """Return the order in which ways to read a text are preferred."""
        grouped = any(GROUPED in kinds for _, fields, kinds in self.lines if len(fields) == self.width)
        marked = self.separator != " " and self.width > 1
        order = -_SEPARATORS.index((self.separator, self.decimal))
        return self.rows, not grouped, marked, self.width, order

    def lines_from_first(self) -> int:
        """Return the number of lines from the first row on."""
        first = next((k for k, line in enumerate(self.lines) if len(line[2]) == self.width and _is_strict(line[2])), 0)
        return len(self.lines) - first


def text_layout(lines: list[str], *, separator: str | None, decimal: str | None) -> TextLayout:
    """Find the table in the first lines of a text.

    Raises
    ------
    InputError
        If there is none, or it can be read in two ways.
    """
    ways = _ways(lines, separator, decimal)
    candidates = [rows for s, d in ways if (rows := _strict_rows(lines, s, d)) is not None]
    best = max(candidates, key=_Rows.rank, default=None)
    if best is None or 2 * best.rows < best.lines_from_first():
        candidates += [rows for s, d in ways if (rows := _loose_rows(lines, s, d)) is not None]
        loose = max((rows for rows in candidates if rows.loose), key=_Rows.rank, default=None)
        best = loose if best is None or (loose is not None and loose.rows >= 2 * best.rows) else best
    if best is None:
        raise InputError(no_table(lines))
    if decimal is None:
        _refuse_two_decimals(best, candidates)
    layout = _layout(best)
    if separator is None and decimal is None and best.separator == "," and best.width == 2:
        _refuse_ambiguous(lines, layout.first)
    if best.separator == " " and separator is None:
        _refuse_groups_of_blanks(lines, layout)
    return layout


def is_row(fields: list[str], layout: TextLayout) -> bool:
    """Return whether the fields of a line are a whole row of the table."""
    kinds = kinds_of(fields, layout.decimal)
    return len(kinds) == layout.columns and _fits(kinds, layout.kinds)


def _ways(lines: list[str], separator: str | None, decimal: str | None) -> list[tuple[str, str]]:
    quoted = any(_QUOTED_COMMA.search(line) for line in lines if '"' in line)
    ways = [(s, d) for s, d in _SEPARATORS if separator in (None, s) and decimal in (None, d)]
    return [way for way in ways if way != (",", ",") or quoted] or ways


def _lines_of(lines: list[str], separator: str, decimal: str) -> list[tuple[int, list[str], str]]:
    rows = ((i, split(line, separator)) for i, line in enumerate(lines) if line.strip())
    return [(i, fields, kinds_of(fields, decimal)) for i, fields in rows]


def _strict_rows(lines: list[str], separator: str, decimal: str) -> _Rows | None:
    """Return the lines with the width that most lines of nothing but numbers and clock times have."""
    rows = _lines_of(lines, separator, decimal)
    widths = Counter(len(kinds) for _, _, kinds in rows if _is_strict(kinds))
    if not widths:
        return None
    width, count = max(widths.items(), key=lambda item: (item[1], item[0]))
    return _Rows(separator=separator, decimal=decimal, lines=rows, width=width, rows=count)


def _loose_rows(lines: list[str], separator: str, decimal: str) -> _Rows | None:
    """Return the lines with the most frequent width, where some columns hold numbers and others words."""
    rows = _lines_of(lines, separator, decimal)
    widths = Counter(len(kinds) for _, _, kinds in rows if len(kinds) > 1 and NUMBER in kinds)
    for width, count in widths.most_common(1):
        alike = [kinds for _, _, kinds in rows if len(kinds) == width][-int(_MOSTLY * count) :]
        numeric = [i for i, kind in enumerate(_column_kinds(alike)) if kind == NUMBER]
        fitting = sum(all(kinds[i] in NUMBER + GROUPED + MISSING + OVERLOAD for i in numeric) for kinds in alike)
        if numeric and count >= _SHORTEST_MIXED and fitting >= _MOSTLY * len(alike):
            return _Rows(separator=separator, decimal=decimal, lines=rows, width=width, rows=count, loose=True)
    return None


def _is_strict(kinds: str) -> bool:
    return (NUMBER in kinds or GROUPED in kinds) and WORD not in kinds and FLAG not in kinds


def _column_kinds(rows: list[str]) -> str:
    """Return the kind of each column: that of most fields that are present; numbers need half of them."""
    kinds = ""
    for column in zip(*rows, strict=True):
        count = Counter(kind for kind in column if kind not in MISSING + OVERLOAD)
        numbers = count[NUMBER] + count[GROUPED]
        if not count:
            kinds += NUMBER if OVERLOAD in column else MISSING
        elif 2 * numbers >= count.total():
            kinds += NUMBER
        else:
            most = count.most_common(1)[0][0]
            kinds += most if most in CLOCKS and count[most] > _MOSTLY * count.total() else _clock_or_word(count)
    return kinds


def _clock_or_word(count: Counter[str]) -> str:
    """Return the kind of a column of dates and words; dates with and without a time are moments."""
    most = count.most_common(1)[0][0]
    return most if set(count) <= set(CLOCKS) or most == FLAG else WORD


def _layout(rows: _Rows) -> TextLayout:
    lines, width = rows.lines, rows.width
    alike = [len(kinds) == width and (rows.loose or _is_strict(kinds)) for _, _, kinds in lines]
    if rows.loose:
        kinds = _column_kinds([kinds for _, _, kinds in lines if len(kinds) == width][-int(_MOSTLY * rows.rows) :])
        alike = [fits and _fits(line[2], kinds) for fits, line in zip(alike, lines, strict=True)]
    starts = [k for k, fits in enumerate(alike) if fits]
    start = next((k for k in starts if k + 1 < len(lines) and len(lines[k + 1][2]) == width), starts[0])
    kinds = _column_kinds([line[2] for line, fits in zip(lines[start:], alike[start:], strict=True) if fits])
    while start and _is_damaged_row(lines[start - 1], lines[start], kinds):
        start -= 1
    numbered = _is_numbered(lines, start, kinds)
    start += numbered
    _refuse_ragged(lines, start - numbered, width)
    _refuse_first_counts(lines, start, kinds)
    body = [line for line in lines[start:] if len(line[2]) == width]
    side_columns = _side_columns(body, kinds)
    kinds = "".join(
        WORD if kind == MISSING and any(line[2][i] == WORD for line in body) else kind for i, kind in enumerate(kinds)
    )
    return TextLayout(
        separator=rows.separator,
        decimal=rows.decimal,
        first=lines[start][0],
        kinds=kinds,
        grouped=any(GROUPED in line[2] for line in body),
        side_columns=side_columns,
        numbered=numbered,
        mixed=rows.loose,
    )


def _fits(kinds: str, columns: str) -> bool:
    """Return whether the fields of a line have the kinds of the columns, and hold a number."""
    numbers = [kind for kind, column in zip(kinds, columns, strict=True) if column == NUMBER]
    return all(kind in NUMBER + GROUPED + MISSING + OVERLOAD for kind in numbers) and (
        NUMBER in numbers or GROUPED in numbers or set(numbers) == {OVERLOAD}
    )


def _is_damaged_row(line: tuple[int, list[str], str], below: tuple[int, list[str], str], columns: str) -> bool:
    """Return whether a line just above the rows is a row too, though it holds a word in place of a number.

    Names may be plain whole numbers, those of channels; a row holds other numbers, or a mark of an overload.
    """
    number, fields, kinds = line
    if len(kinds) != len(columns) or below[0] != number + 1:
        return False
    numeric = [i for i, column in enumerate(columns) if column == NUMBER]
    numbers = [i for i in numeric if kinds[i] in NUMBER + GROUPED]
    if not numbers:
        return all(kinds[i] == OVERLOAD for i in numeric) and any(fields[i].strip("-=*#") for i in numeric)
    if any(kinds[i] == OVERLOAD for i in numeric) or kinds[numeric[0]] in NUMBER + GROUPED:
        return True
    return not all(is_count(fields[i]) for i in numbers)


def _is_numbered(lines: list[tuple[int, list[str], str]], start: int, columns: str) -> bool:
    """Return whether the first row counts the columns from 0 or 1 where all others hold decimal numbers."""
    fields = lines[start][1]
    named = fields[1:] if fields and not fields[0] else fields
    if len(named) < 2 or not all(map(is_count, named)):
        return False
    counts = [int(field) for field in named]
    if counts != list(range(counts[0], counts[0] + len(counts))) or counts[0] > 1:
        return False
    rows = [line[1][-len(named) :] for line in lines[start + 1 : start + 21] if len(line[1]) == len(columns)]
    fractions = [sum(not field.isdigit() for field in column) for column in zip(*rows, strict=True)]
    return len(rows) >= 5 and all(2 * count > len(rows) for count in fractions)


def _refuse_first_counts(lines: list[tuple[int, list[str], str]], start: int, columns: str) -> None:
    """Refuse whole numbers in the first row where all others hold decimal numbers: a rate or a number of samples."""
    numeric = [i for i, kind in enumerate(columns) if kind == NUMBER]
    first = [lines[start][1][i] for i in numeric]
    rows = [line[1] for line in lines[start + 1 : start + 31] if len(line[1]) == len(columns)]
    whole = all(field.isdigit() and int(field) > 1 for field in first)
    if whole and len(rows) >= 10 and not any(row[i].lstrip("+-").isdigit() for row in rows for i in numeric):
        raise InputError(
            f"line {lines[start][0] + 1}, {', '.join(first)[:40]!r}, holds whole numbers and the lines below none, so "
            "it may state a rate or a number of samples; remove it, or write it with a point"
        )


def _side_columns(body: list[tuple[int, list[str], str]], columns: str) -> int:
    """Return the number of leading columns that hold facts in the first rows and nothing in the others."""
    first = columns.find(NUMBER)
    if first < 2 or columns[0] != MISSING or not body or body[0][2][0] != WORD:
        return 0
    return first


def _refuse_ragged(lines: list[tuple[int, list[str], str]], start: int, columns: int) -> None:
    for i, fields, kinds in lines[:start]:
        if len(kinds) > 1 and set(kinds) <= set(NUMBER + GROUPED + OVERLOAD) and set(kinds) != {OVERLOAD}:
            if all(is_count(field) for field in fields) and len(kinds) == columns:
                continue
            raise InputError(f"line {i + 1} has {len(fields)} numbers, later lines have {columns}; mend or remove it")


def no_table(lines: list[str]) -> str:
    """Return the message that lines hold no table."""
    shown = next((line.strip() for line in lines if line.strip()), "")[:60]
    return f"holds no table of numbers in its first {len(lines)} lines; the first is {shown!r}"


def _refuse_two_decimals(best: _Rows, candidates: list[_Rows]) -> None:
    """Refuse numbers whose mark may be a decimal sign or one of thousands."""
    other = next(
        (rows for rows in candidates if rows.separator == best.separator and rows.decimal != best.decimal and
         (rows.rows, rows.width) == (best.rows, best.width)), None,
    )  # fmt: skip
    if other is None or best.separator == ",":
        return
    columns = list(_numbers_by_column(best))
    for mark in ",.":
        marked = [(i, field) for column in columns for i, field in column if mark in field]
        mixed = any(
            any(mark in field for _, field in column) and any(field.isdigit() for _, field in column)
            for column in columns
        )
        if marked and (mark == "," or mixed) and all(_is_group(field, mark) for _, field in marked):
            i, field = marked[0]
            raise InputError(
                f"line {i + 1}: {field!r} has a mark of thousands or a decimal sign; give decimal='.' or decimal=','"
            )


def _numbers_by_column(rows: _Rows) -> Iterator[list[tuple[int, str]]]:
    body = [line for line in rows.lines if len(line[2]) == rows.width]
    for at in range(rows.width):
        yield [(i, fields[at]) for i, fields, kinds in body if kinds[at] in NUMBER + GROUPED]


def _is_group(field: str, mark: str) -> bool:
    """Return whether a mark of thousands may stand in a number where the mark is."""
    whole, _, group = field.lstrip("+-").rpartition(mark)
    return len(group) == 3 and group.isdigit() and whole.isdigit() and len(whole) <= 3 and not whole.startswith("0")


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


def _refuse_groups_of_blanks(lines: list[str], layout: TextLayout) -> None:
    """Refuse groups of three digits after blanks, which may be thousands of a single number."""
    rows = [line.strip() for line in lines[layout.first :] if line.strip()]
    if all(re.fullmatch(r"[+-]?[1-9][0-9]{0,2}( [0-9]{3})+([.,][0-9]+)?", row) for row in rows):
        raise InputError(
            f"line {layout.first + 1}, {rows[0][:40]!r}, is {layout.columns} numbers or one with marks of thousands; "
            "write it with another separator"
        )
