"""Tables of numbers in text that are read in blocks of rows."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import SHORTEST_BLOCK, Contents, block_length
from sigdb.recording.files.formats.text.body import (
    body_end,
    is_double_spaced,
    refuse_blank_line,
    without_blank_lines,
)
from sigdb.recording.files.formats.text.encoding import TextStream, encoded_text
from sigdb.recording.files.formats.text.fields import CLOCKS
from sigdb.recording.files.formats.text.reader import FIRST_BYTES, TextTable, table_contents, text_table
from sigdb.recording.files.formats.text.records import records
from sigdb.recording.files.settings import RecordingSettings

_READ = 2**22
"""Bytes that are read at a time."""

_MOST_HELD = 2**29
"""Largest number of bytes of a block of rows."""


def text_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the columns of a table of numbers in blocks of rows.

    The first mebibyte decides on encoding, layout and names for all rows.

    Parameters
    ----------
    path
        The file.
    settings
        Settings of reading; separator and decimal are used.
    samples
        Rows of a block.
    """
    with path.open("rb") as stored:
        file = TextStream(stored)
        begin, beyond = _first_lines(file)
        data, notes = encoded_text(begin)
        if settings.separator is None and records(data) is not None:
            raise InputError("holds several waves below each other, which are not read in blocks; cut it between them")
        table = text_table(data, settings)
        rest = begin
        for _ in range(table.layout.first):
            rest = rest[rest.index(b"\n") + 1 :]
        blocks = _Rows(file, rest + beyond, block_length(table.layout.columns, samples))
        doubled = is_double_spaced(encoded_text(rest)[0])
        first = table.layout.first
        last_row: tuple[bytes, dict[str, float]] | None = None
        for rows, is_last in blocks:
            part = _at(table, first)
            body, encoding = encoded_text(rows)
            first += body.count(b"\n")
            footer: tuple[Note, ...] = ()
            if doubled:
                body = without_blank_lines(body)
            if is_last:
                body, footer = body_end(body, part.layout)
            elif not doubled:
                refuse_blank_line(body, part.layout)
            contents, last_row = _joined(part, body, (*notes, *encoding), footer, last_row)
            yield contents


def _first_lines(file: TextStream) -> tuple[bytes, bytes]:
    """Return the first lines, and the bytes that were read of the line after them."""
    begin = file.read(FIRST_BYTES)
    if len(begin) < FIRST_BYTES:
        return (begin if b"\n" in begin else begin.replace(b"\r", b"\n")), b""
    end = begin.rfind(b"\n") + 1
    if not end:
        raise InputError(f"has no line end in its first {FIRST_BYTES} bytes; it is no table of rows")
    return begin[:end], begin[end:]


def _at(table: TextTable, first: int) -> TextTable:
    return replace(table, layout=replace(table.layout, first=first))


@dataclass(frozen=True)
class _Rows:
    """Rows of a text in blocks, as bytes with whether they are the last; those may be more."""

    file: TextStream
    begin: bytes
    length: int

    def __iter__(self) -> Iterator[tuple[bytes, bool]]:
        held = [self.begin]
        lines = self.begin.count(b"\n")
        while True:
            while lines < self.length + SHORTEST_BLOCK and (data := self.file.read(_READ)):
                held.append(data)
                lines += data.count(b"\n")
                if sum(map(len, held)) > _MOST_HELD:
                    raise InputError(f"holds {lines} lines in {_MOST_HELD} bytes, so it is no table of rows")
            data = b"".join(held)
            if lines < self.length + SHORTEST_BLOCK:
                yield data, True
                return
            ends = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n"))
            end = int(ends[self.length - 1]) + 1
            yield data[:end], False
            held, lines = [data[end:]], lines - self.length


def _joined(
    table: TextTable,
    body: bytes,
    notes: tuple[Note, ...],
    footer: tuple[Note, ...],
    before: tuple[bytes, dict[str, float]] | None,
) -> tuple[Contents, tuple[bytes, dict[str, float]] | None]:
    """Return the columns of rows, and the last row with its clock times, from which those of the next rows go on.

    Clock times are seconds after the first row of a table, so the row before these is read with them.
    """
    layout = table.layout
    clocks = any(kind in CLOCKS for kind in layout.kinds)
    if not clocks:
        return table_contents(table, body, notes, footer), None
    if before is not None:
        body = before[0] + body
        table = _at(table, layout.first - 1)
    contents = table_contents(table, body, notes, footer)
    since = before[1] if before is not None else {}
    columns = tuple(
        replace(column, values=column.values[0 if before is None else 1 :] + since.get(column.name, 0.0))
        for column in contents.columns
    )
    in_seconds = {
        column.name: float(column.values[-1])
        for i, column in enumerate(columns)
        if _is_clock(table, column.name) and np.isfinite(column.values[-1:]).all()
    }
    row = body.rstrip()
    return replace(contents, columns=columns), (row[row.rfind(b"\n") + 1 :] + b"\n", in_seconds)


def _is_clock(table: TextTable, name: str) -> bool:
    """Return whether a column holds clock times."""
    layout = table.layout
    return any(kind in CLOCKS and other == name for kind, other in zip(layout.kinds, table.names, strict=True))
