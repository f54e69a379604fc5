"""Numbers in text: CSV, TXT and their relatives, plain or gzipped."""

import io
import re
import zlib
from pathlib import Path

import numpy as np

from sigdb.core.errors import InputError
from sigdb.measurement.readers.contents import Column, Contents
from sigdb.measurement.readers.limits import (
    FREE_BYTES,
    MAX_BYTES,
    MAX_RATIO,
    bounded_bytes,
    check_columns,
    check_ratio,
    check_values,
)
from sigdb.measurement.readers.text_layout import MISSING, SAMPLE_LINES, TextLayout, is_row, text_layout
from sigdb.measurement.recording_settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = (zlib.error,)

FIRST_BYTES = 2**20
"""A table begins within these, and no line is longer."""

LONGEST_LINE = 2**16
"""Bytes of a line in which a table is looked for."""

_UTF16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
_UNIT = re.compile(r"(.*\S)\s*[\[(]([^\[\]()]{1,20})[\])]")


def read_text(path: Path, settings: RecordingSettings) -> Contents:
    """Columns of a table of numbers; ``name [unit]`` and a line of units are understood."""
    data = plain_text(bounded_bytes(path))
    lines = [line[:LONGEST_LINE].decode("utf-8", "replace") for line in _first_lines(data)]
    layout = text_layout(lines, separator=settings.separator, decimal=settings.decimal)
    check_columns(layout.columns)
    check_values(layout.columns * (data.count(b"\n") + 1 - layout.first))
    table, cut = _without_torn_line(_below(data, layout.first), layout)
    columns = _columns(_named(layout), _parsed(table, layout), layout)
    return Contents(columns=columns, notes=(*layout.notes, *cut, *_clock_notes(layout)), named=layout.names is not None)


def plain_text(data: bytes) -> bytes:
    """Text without compression, byte order mark and foreign line ends."""
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
    """All members of a gzip file; its length is never more than the limits allow."""
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


def _without_torn_line(table: bytes, layout: TextLayout) -> tuple[bytes, tuple[str, ...]]:
    """The table without a last line that a recorder did not finish."""
    if table.endswith(b"\n"):
        return table, ()
    whole, end, last = table.rpartition(b"\n")
    if not end or not last.strip() or len(last) > FIRST_BYTES or is_row(last.decode("utf-8", "replace"), layout):
        return table, ()
    return whole + end, ("the last line is not whole and was left out",)


def _parsed(table: bytes, layout: TextLayout) -> dict[str, "np.ndarray[tuple[int], np.dtype[np.float64]]"]:
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
            number, found = ragged[0]
            raise InputError(
                f"line {number + layout.first} has {found} columns, others have {layout.columns}; mend or remove it"
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
    found = re.search(r"In CSV column #(\d+): (?:Row #(\d+): )?.*invalid value '(.*)'", message, re.DOTALL)
    if found is None:
        return f"is not a table of numbers ({message})"
    line = f"line {int(found[2]) + layout.first}, " if found[2] else ""
    return f"{line}column {int(found[1]) + 1}: {found[3][:40]!r} is not a number; mend it, or leave it empty"


def _named(layout: TextLayout) -> list[tuple[str, str]]:
    """Name and unit of each column."""
    names = layout.names or tuple(f"column{i + 1}" for i in range(layout.columns))
    units = layout.units or ("",) * layout.columns
    return [
        (found[1], found[2].strip()) if not unit and (found := _UNIT.fullmatch(name[:200])) else (name, unit)
        for name, unit in zip(names, units, strict=True)
    ]


def _columns(
    named: list[tuple[str, str]], values: dict[str, "np.ndarray[tuple[int], np.dtype[np.float64]]"], layout: TextLayout
) -> tuple[Column, ...]:
    """Columns of numbers; what stands behind a last separator is none."""
    kept = [i for i in range(layout.columns) if str(i) in values]
    if len(kept) > 1 and not named[kept[-1]][0].strip() and np.isnan(values[str(kept[-1])]).all():
        kept = kept[:-1]
    return tuple(Column(name=named[i][0] or f"column{i + 1}", unit=named[i][1], values=values[str(i)]) for i in kept)


def _clock_notes(layout: TextLayout) -> tuple[str, ...]:
    named = _named(layout)
    return tuple(f"{named[i][0]} holds dates or clock times and was left out" for i in layout.clocks)
