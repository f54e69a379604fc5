"""Values of the columns of a table in a text."""

import io
import re
from typing import TYPE_CHECKING

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.recording.files.formats.text.fields import (
    CLOCKS,
    MISSING,
    MISSING_WORDS,
    NUMBER,
    OVERLOAD,
    kind_of,
)
from sigdb.recording.files.formats.text.layout import TextLayout

if TYPE_CHECKING:
    import pyarrow as pa

OVERLOADED = 9e37
"""Numbers from here on mark an overload: instruments write 9.9E+37."""

_NULLS = [spelt for word in MISSING_WORDS for spelt in {word, word.upper(), word.capitalize(), "NaN"}]
_GROUP_MARKS = ("'", "\u2019", "\u00a0", "\u202f", "\u2009", " ")


def table_values(
    body: bytes, layout: TextLayout, names: tuple[str, ...]
) -> "tuple[dict[int, FloatArray], dict[int, pa.ChunkedArray]]":
    """Return the columns of numbers, and those of texts: clock times and empty ones. Others are not read.

    Parameters
    ----------
    body
        The rows.
    layout
        Layout of the table.
    names
        Names of the columns, for messages.

    Raises
    ------
    InputError
        If a row has another width than the others, or a field of a column of numbers is none.
    """
    import pyarrow as pa
    from pyarrow import csv

    numeric = [i for i, kind in enumerate(layout.kinds) if kind == NUMBER and i >= layout.side_columns]
    texts = [i for i, kind in enumerate(layout.kinds) if kind in CLOCKS + MISSING and i >= layout.side_columns]
    body = _plain_numbers(body, layout)
    separator = layout.separator
    if separator == " ":
        separator, body = _separated(body)
    ragged: list[tuple[int, int]] = []

    def note(row: "csv.InvalidRow") -> str:
        ragged.append((row.number or 0, row.actual_columns))
        return "error"

    try:
        read = csv.read_csv(
            io.BytesIO(body),
            read_options=csv.ReadOptions(column_names=[str(i) for i in range(layout.columns)], use_threads=False),
            parse_options=csv.ParseOptions(delimiter=separator, invalid_row_handler=note),
            convert_options=csv.ConvertOptions(
                column_types={str(i): pa.float64() for i in numeric} | {str(i): pa.string() for i in texts},
                decimal_point=layout.decimal,
                include_columns=[str(i) for i in sorted([*numeric, *texts])],
                null_values=_NULLS,
                strings_can_be_null=True,
            ),
        )
    except pa.ArrowInvalid as error:
        if ragged:
            number, width = ragged[0]
            raise InputError(_ragged(body, number, width, layout)) from None
        raise InputError(_with_line(str(error), body, layout, names)) from None
    values = {i: read.column(str(i)).to_numpy() for i in numeric}
    for i, x in values.items():
        _refuse_overloads(x, layout, names[i])
    return values, {i: read.column(str(i)) for i in texts}


def _separated(body: bytes) -> tuple[str, bytes]:
    """Return rows with a single sign between their fields, and that sign."""
    body = body.replace(b"\t", b" ")
    while b"  " in body:
        body = body.replace(b"        ", b" ").replace(b"  ", b" ")
    for end, plain in ((b" \r", b"\r"), (b" \n", b"\n"), (b"\n ", b"\n")):
        body = body.replace(end, plain) if end in body else body
    return " ", body.strip(b" ")


def _plain_numbers(body: bytes, layout: TextLayout) -> bytes:
    """Return the rows without marks of thousands, and with the exponents of Fortran as those of others."""
    if layout.grouped:
        main = "," if layout.decimal == "." else "."
        if main == layout.separator:
            body = re.sub(rb'"[^"\n]*"', lambda quoted: _without_groups(quoted[0], main), body)
        for mark in (main, *_GROUP_MARKS):
            if mark != layout.separator and mark.encode() in body:
                body = _without_groups(body, mark)
    if re.search(rb"[0-9.][dD][+-]?[0-9]", body[:4096]) and WORDLESS.issuperset(layout.kinds):
        body = re.sub(rb"(?<=[0-9.])[dD](?=[+-]?[0-9])", b"e", body)
    return body


def _without_groups(text: bytes, mark: str) -> bytes:
    """Return a text without a mark where it groups thousands; in other places it stays."""
    return re.sub(rb"(?<=[0-9])(?<![0-9]{4})%b(?=[0-9]{3}(?![0-9]))" % re.escape(mark.encode()), b"", text)


WORDLESS = frozenset(NUMBER + MISSING)
"""Kinds of columns in which letters can only belong to numbers."""


def _ragged(body: bytes, number: int, width: int, layout: TextLayout) -> str:
    line = f"line {number + layout.first}"
    if number and (words := _words(body, number)):
        return f"{line}, {words!r}, stands between rows, so a second table may follow; cut the file there, or remove it"
    return f"{line} has {width} columns, others have {layout.columns}; mend or remove it"


def _words(body: bytes, number: int) -> str:
    """Return the beginning of a line of the body if it begins with a word; else an empty text."""
    at = -1
    for _ in range(number - 1):
        at = body.find(b"\n", at + 1)
    line = body[at + 1 : at + 200].split(b"\n")[0].decode("utf-8", "replace").strip()
    return line[:40] if line[:1].isalpha() or line[:1] in ('"', "#", "%", "[") else ""


def _refuse_overloads(x: FloatArray, layout: TextLayout, name: str) -> None:
    with np.errstate(invalid="ignore"):
        wrong = (np.abs(x) >= OVERLOADED) & np.isfinite(x)
    if wrong.any():
        at = int(np.argmax(wrong))
        raise InputError(
            f"line {at + layout.first + 1}, column {name}: {x[at]:.3g} marks an overload; cut the recording there, or "
            "record it again with a larger range"
        )


def _with_line(message: str, body: bytes, layout: TextLayout, names: tuple[str, ...]) -> str:
    cell = re.search(r"In CSV column #(\d+): (?:Row #(\d+): )?.*invalid value '(.*)'", message, re.DOTALL)
    if cell is None:
        return f"is not a table of numbers ({message})"
    line = f"line {int(cell[2]) + layout.first}, " if cell[2] else ""
    at, value = int(cell[1]), cell[3].strip()
    column = f"column {at + 1}" + (f" ({names[at]})" if at < len(names) and names[at] != f"column{at + 1}" else "")
    if at == 0 and cell[2] and (words := _words(body, int(cell[2]))) and kind_of(value, layout.decimal) != OVERLOAD:
        return f"{line}{words!r}, stands between rows, so a second table may follow; cut the file there, or remove it"
    if kind_of(value, layout.decimal) == OVERLOAD:
        return (
            f"{line}{column}: {value[:40]!r} marks an overload or no number; cut the recording there, or leave the "
            "field empty"
        )
    return f"{line}{column}: {value[:40]!r} is not a number; mend it, or leave it empty"
