"""Reader of tables of numbers in text: CSV, TXT and similar files, plain or gzipped."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.contents import Contents, DataColumn, bounded_bytes, check_columns, check_values
from sigdb.recording.files.formats.text.body import table_body
from sigdb.recording.files.formats.text.clocks import ClockColumn, clock_columns, elapsed_seconds
from sigdb.recording.files.formats.text.encoding import FOREIGN, decoded, encoded_text
from sigdb.recording.files.formats.text.fields import CLOCKS, DATE, FLAG, MISSING, NOON, NUMBER, WORD, split
from sigdb.recording.files.formats.text.header import TextHeader, text_header
from sigdb.recording.files.formats.text.layout import (
    MOST_LINES,
    SAMPLE_LINES,
    TextLayout,
    is_row,
    no_table,
    text_layout,
)
from sigdb.recording.files.formats.text.records import records
from sigdb.recording.files.formats.text.values import table_values
from sigdb.recording.files.settings import RecordingSettings

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = [
    "FIRST_BYTES",
    "FOREIGN",
    "LONGEST_LINE",
    "TextTable",
    "read_text",
    "table_contents",
    "text_contents",
    "text_table",
]

FIRST_BYTES = 2**20
"""Number of bytes in which a table must begin."""

LONGEST_LINE = 2**16
"""Bytes of a line in which the beginning of a table is searched."""

_WORDS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "blanks"}
_HELD = {WORD: "words", FLAG: "true and false", DATE: "dates without clock times", NOON: "AM and PM"}


_ALONE = re.compile(r"\s*[^\W\d_][\w ]{0,30}:\s*")
_LABELLED_LINES = 100


def read_text(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of a table of numbers, with names, units and sampling rate from the lines above it."""
    data, notes = encoded_text(bounded_bytes(path))
    return text_contents(data, settings, notes)


def text_contents(data: bytes, settings: RecordingSettings, notes: tuple[Note, ...] = ()) -> Contents:
    """Return the columns of a table in a text.

    Parameters
    ----------
    data
        The text as UTF-8.
    settings
        Settings of reading; separator and decimal are used.
    notes
        Notes on its encoding.

    Raises
    ------
    InputError
        If it holds no table of numbers, or the table can be read in two ways.
    """
    if settings.separator is None and (waves := records(data)) is not None:
        return waves
    table = text_table(data, settings)
    check_values(table.layout.columns * (data.count(b"\n") + 1 - table.layout.first))
    body, footer = table_body(data, table.layout)
    return table_contents(table, body, notes, footer)


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """A table in a text: its layout, what the lines above it state, its first rows, and its empty columns."""

    layout: TextLayout
    header: TextHeader
    rows: list[str]
    empty: frozenset[int]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its columns."""
        return _names(self.header, self.layout)


def text_table(data: bytes, settings: RecordingSettings) -> TextTable:
    """Return the table that the first lines of a text begin.

    Raises
    ------
    InputError
        If there is none, or it can be read in two ways.
    """
    lines, layout = _located(data, settings)
    check_columns(layout.columns)
    rows = lines[layout.first :]
    side = layout.side_columns
    side_fields = [split(row, layout.separator)[:side] for row in rows] if side else []
    header = text_header(lines[: layout.first], layout, side_fields=side_fields, row=rows[0])
    table = TextTable(layout=layout, header=header, rows=rows, empty=_empty(rows, layout))
    _refuse_split_seconds(rows, layout, table.names)
    return table


def table_contents(
    table: TextTable, body: bytes, notes: tuple[Note, ...] = (), footer: tuple[Note, ...] = ()
) -> Contents:
    """Return the columns of a table.

    Parameters
    ----------
    table
        The table; the first line of its layout is the number of lines before the rows.
    body
        Its rows, or some that follow each other.
    notes, footer
        Notes on the encoding, and on what follows the table.

    Raises
    ------
    InputError
        If a row is no row of the table.
    """
    layout, header, names = table.layout, table.header, table.names
    numbers, texts = table_values(body, layout, names)
    clocks, clock_notes = _clocks(texts, layout, names)
    columns, left = _columns(numbers | clocks, texts, header, layout, empty=table.empty)
    if len(columns) == 1:
        _refuse_other_numbers(table.rows, layout, names)
    return Contents(
        columns=columns,
        sampling_rate=header.facts.sampling_rate,
        rate_from=header.facts.rate_from,
        notes=(*notes, *_format_notes(layout), *header.notes, *footer, *clock_notes, *left),
        named=header.names is not None,
        speed_rpm=header.facts.speed_rpm,
    )


def _located(data: bytes, settings: RecordingSettings) -> tuple[list[str], TextLayout]:
    """Return the first lines and the layout; a table that begins late, or not at all, is sought in more lines."""
    separator: str | None = settings.separator
    lines = _first_lines(data, SAMPLE_LINES)
    if separator is None and (stated := _stated_separator(lines[0])) is not None:
        separator = stated
    try:
        layout = text_layout(lines, separator=separator, decimal=settings.decimal)
        if len(lines) < SAMPLE_LINES or (layout.first < SAMPLE_LINES // 2 and _goes_on(data, layout)):
            return lines, layout
    except InputError:
        if len(lines) < SAMPLE_LINES:
            raise
    lines = _first_lines(data, MOST_LINES)
    layout = text_layout(lines, separator=separator, decimal=settings.decimal)
    if not _goes_on(data, layout):
        raise InputError(no_table(lines))
    return lines, layout


def _goes_on(data: bytes, layout: TextLayout) -> bool:
    """Return whether a table of numbers and words goes on to the end of a text."""
    last = [decoded(line) for line in data[-LONGEST_LINE:].split(b"\n")[-40:] if line.strip()][1:]
    rows = sum(is_row(split(line, layout.separator), layout) for line in last)
    return not layout.mixed or 2 * rows >= len(last)


def _stated_separator(line: str) -> str | None:
    """Return the separator that the first line states for spreadsheets, as in "sep=;"."""
    stated = line.strip().strip('"')
    return stated[4:] if stated[:4].lower() == "sep=" and stated[4:] in (",", ";", "\t") else None


def _first_lines(data: bytes, most: int) -> list[str]:
    """Return the first lines; a line with line ends in quotes is joined after blank lines for its parts."""
    lines = data[:FIRST_BYTES].split(b"\n", most)[:most]
    lines = lines[:-1] if len(lines) > 1 and len(data) > FIRST_BYTES else lines
    texts = [decoded(line[:LONGEST_LINE]) for line in lines]
    for i in range(len(texts)):
        for k in range(i + 1, min(i + 5, len(texts))):
            if texts[i].count('"') % 2 == 0:
                break
            if sum(part.count('"') for part in texts[i : k + 1]) % 2 == 0:
                joined = " ".join(part.strip() for part in texts[i : k + 1])
                texts[i : k + 1] = [*[""] * (k - i), joined]
                break
    return _with_labels(texts)


def _with_labels(lines: list[str]) -> list[str]:
    """Return the lines; one between two labels that end with a colon, as "dt:", follows the first on its line."""
    lines = list(lines)
    labels = [_ALONE.fullmatch(line) is not None for line in lines[:_LABELLED_LINES]]
    for i in range(len(labels) - 2):
        if labels[i] and labels[i + 2] and not labels[i + 1]:
            lines[i : i + 2] = "", f"{lines[i].strip()}\t{lines[i + 1].strip()}"
    return lines


def _names(header: TextHeader, layout: TextLayout) -> tuple[str, ...]:
    names = header.names or ("",) * layout.columns
    return tuple(name.strip() or f"column{i + 1}" for i, name in enumerate(names))


def _format_notes(layout: TextLayout) -> list[Note]:
    notes = []
    s, d = layout.separator, layout.decimal
    if (s, d) != (",", "."):
        text = f"read with {_WORDS[s]} between numbers and decimal {'comma' if d == ',' else 'point'}"
        notes.append(Note(code="text-format", text=text, values={"separator": s, "decimal": d}))
    if layout.grouped:
        notes.append(Note(code="marks-of-thousands", text="marks of thousands were removed from numbers"))
    if layout.numbered:
        text = f"line {layout.first} counts the columns and was taken for their names"
        notes.append(Note(code="numbered-columns", text=text, values={"line": layout.first}))
    return notes


def _refuse_split_seconds(lines: list[str], layout: TextLayout, names: tuple[str, ...]) -> None:
    """Refuse a fraction of seconds that stands in a column of its own, behind a comma."""
    rows = [fields for line in lines if len(fields := split(line, layout.separator)) == layout.columns]
    for i, kind in enumerate(layout.kinds[:-1]):
        if layout.separator != "," or kind not in CLOCKS or layout.kinds[i + 1] != NUMBER or not rows:
            continue
        fractions = [row[i + 1] for row in rows]
        alike = {(len(fraction), fraction.isdigit()) for fraction in fractions} <= {(n, True) for n in (3, 6, 7, 9)}
        whole = all("." not in row[i] for row in rows)
        if alike and whole and any(fraction.startswith("0") for fraction in fractions):
            raise InputError(
                f"line {layout.first + 1}, column {names[i]}: a comma stands before the fraction of a second; write it "
                "with a point, or with another separator between columns"
            )


def _clocks(
    texts: "dict[int, pa.ChunkedArray]", layout: TextLayout, names: tuple[str, ...]
) -> tuple[dict[int, FloatArray], list[Note]]:
    """Return the columns of seconds by their positions, and notes; those that are no times of samples are left out."""
    kept: dict[int, FloatArray] = {}
    notes: list[Note] = []
    for clock in clock_columns(layout.kinds, names):
        seconds, note = elapsed_seconds(_joined(texts, clock), name=clock.name, first=layout.first)
        reason = "another column holds them too" if kept else _no_times(seconds, layout.first)
        if reason:
            notes.append(_left_out(clock.name, f"dates or clock times and was left out: {reason}"))
        else:
            kept[_place(clock, layout)] = seconds
            notes.append(note)
    return kept, notes


def _place(clock: ClockColumn, layout: TextLayout) -> int:
    return next((i for i in clock.columns if layout.kinds[i] not in (DATE, NOON)), clock.columns[0])


def _joined(texts: "dict[int, pa.ChunkedArray]", clock: ClockColumn) -> "pa.ChunkedArray":
    from pyarrow import compute

    parts = [texts[i] for i in clock.columns]
    return parts[0] if len(parts) == 1 else compute.binary_join_element_wise(*parts, " ")


def _no_times(seconds: FloatArray, first: int) -> str:
    """Return the reason why clock times cannot be those of the samples; empty if they can."""
    present = np.flatnonzero(~np.isnan(seconds))
    steps = np.diff(seconds[present])
    if not steps.size or not steps.any():
        return "it does not change"
    if steps.min() < 0:
        return f"it falls at line {first + int(present[np.argmin(steps) + 1]) + 1}"
    if np.count_nonzero(steps) < steps.size / 4:
        return "its resolution is too coarse for the samples"
    return ""


def _left_out(name: str, held: str) -> Note:
    code = "clock-column-left-out" if "clock times and" in held else "column-left-out"
    return Note(code=code, text=f"{name} holds {held}", values={"column": name})


def _columns(
    values: dict[int, FloatArray],
    texts: "dict[int, pa.ChunkedArray]",
    header: TextHeader,
    layout: TextLayout,
    *,
    empty: frozenset[int],
) -> tuple[tuple[DataColumn, ...], list[Note]]:
    """Return the columns, and notes on those that were left out; an empty one without a name is none."""
    names = _names(header, layout)
    columns: list[DataColumn] = []
    notes: list[Note] = []
    in_clocks = {i for clock in clock_columns(layout.kinds, names) for i in clock.columns}
    for i in range(layout.side_columns, layout.columns):
        kind, unit = layout.kinds[i], header.units[i]
        x = values.get(i)
        if x is None and kind == MISSING:
            x = _sparse(texts[i], layout.decimal)
        if x is not None and not (i in empty and np.isnan(x).all()):
            columns.append(DataColumn(name=names[i], unit="s" if kind in CLOCKS else unit, values=x))
        elif kind == MISSING:
            if header.names is not None and header.names[i].strip():
                held = "nothing" if x is not None else "words"
                notes.append(_left_out(names[i], f"{held} and was left out"))
        elif kind not in CLOCKS or i not in in_clocks:
            notes.append(_left_out(names[i], f"{_HELD.get(kind, 'clock times')} and was left out"))
    if not columns:
        raise InputError("holds no column of numbers")
    return tuple(columns), notes


def _empty(lines: list[str], layout: TextLayout) -> frozenset[int]:
    """Return the columns in which the first rows have nothing."""
    rows = [fields for line in lines if len(fields := split(line, layout.separator)) == layout.columns]
    return frozenset(i for i in range(layout.columns) if not any(row[i] for row in rows))


def _refuse_other_numbers(lines: list[str], layout: TextLayout, names: tuple[str, ...]) -> None:
    """Refuse a table whose only other columns hold numbers in a form that is not read, such as "0.5 g" or "0x1F"."""
    rows = [fields for line in lines if len(fields := split(line, layout.separator)) == layout.columns]
    for i, kind in enumerate(layout.kinds):
        like = [row[i] for row in rows if row[i].lstrip("+-([ ")[:1].isdigit()] if kind == WORD else []
        if 2 * len(like) > len(rows):
            raise InputError(
                f"column {i + 1} ({names[i]}) holds {like[0][:40]!r} and the like, which are not plain numbers; write "
                "numbers without units or signs around them, or remove the column"
            )


def _sparse(texts: "pa.ChunkedArray", decimal: str) -> FloatArray | None:
    """Return the numbers of a column that is empty in the first rows; None if it holds words."""
    import pyarrow as pa
    from pyarrow import compute

    plain = compute.replace_substring(texts, ",", ".") if decimal == "," else texts
    try:
        x: FloatArray = plain.cast(pa.float64()).to_numpy()
    except pa.ArrowInvalid:
        return None
    return x
