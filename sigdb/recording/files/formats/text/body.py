"""Body of a table in a text: where its rows end, and what follows them."""

import re

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.text.encoding import decoded
from sigdb.recording.files.formats.text.fields import GROUPED, MISSING, NUMBER, OVERLOAD, kinds_of, split
from sigdb.recording.files.formats.text.layout import TextLayout, is_row

LONGEST_LINE = 2**20
"""Bytes of the longest line of a table."""

FOOTER_LINES = 100
"""Largest number of lines after the rows of a table that are left out as a footer."""

_TAIL = 2**16
_BLANK_LINE = re.compile(rb"\n[ \t\r]*(?=\n)")


def table_body(data: bytes, layout: TextLayout) -> tuple[bytes, tuple[Note, ...]]:
    """Return the rows of a table without what follows them, and notes on that.

    Parameters
    ----------
    data
        The whole text.
    layout
        Layout of its table.

    Raises
    ------
    InputError
        If rows follow a blank line: a second table begins there.
    """
    return body_end(_below(data, layout.first), layout)


def body_end(body: bytes, layout: TextLayout) -> tuple[bytes, tuple[Note, ...]]:
    """Return the last rows of a table without what follows them, and notes on that; as :func:`table_body`.

    Parameters
    ----------
    body
        The rows and what follows them.
    layout
        Layout of the table, with the number of lines before these rows.

    Raises
    ------
    InputError
        If rows follow a blank line.
    """
    body, notes = _until_blank_line(body, layout)
    body, footer = _without_footer(body, layout)
    return body, (*footer, *notes)


def _below(data: bytes, lines: int) -> bytes:
    start = 0
    for _ in range(lines):
        start = data.index(b"\n", start) + 1
    return data[start:]


def _until_blank_line(body: bytes, layout: TextLayout) -> tuple[bytes, tuple[Note, ...]]:
    """Return the rows before the first blank line; in a text with a blank line after each row, all of them."""
    at = _blank_line(body)
    if at < 0 or not body[at:].strip():
        return body, ()
    if is_double_spaced(body):
        return without_blank_lines(body), ()
    rest = body[at:].strip()
    line = layout.first + body.count(b"\n", 0, at) + 1
    following = rest.count(b"\n") + 1
    rows = body.count(b"\n", 0, at)
    if following > FOOTER_LINES or 2 * following > rows:
        raise InputError(
            f"line {line + 1} is blank, and {following} lines follow it, so there may be several tables; cut the file "
            "in one for each table, or remove the blank line"
        )
    text = f"{following} lines after the blank line {line + 1} were left out"
    return body[: at + 1], (Note(code="footer-left-out", text=text, values={"lines": following, "line": line + 1}),)


def is_double_spaced(body: bytes) -> bool:
    """Return whether a blank line follows the first or second row, so that one follows each row."""
    at = _blank_line(body)
    return at >= 0 and body.count(b"\n", 0, at) <= 1 and len(body) > at + 2


def without_blank_lines(body: bytes) -> bytes:
    """Return the rows without blank lines."""
    return _BLANK_LINE.sub(b"", body)


def refuse_blank_line(body: bytes, layout: TextLayout) -> None:
    """Refuse rows with a blank line among them.

    Raises
    ------
    InputError
        If there is one: a second table begins there.
    """
    at = _blank_line(body)
    if at >= 0:
        line = layout.first + body.count(b"\n", 0, at) + 2
        raise InputError(
            f"line {line} is blank, and many lines follow it, so there may be several tables; cut the file in one for "
            "each table, or remove the blank line"
        )


def _blank_line(body: bytes) -> int:
    """Return the place of the line end before the first blank line; -1 if there is none."""
    places = [place for mark in (b"\n\n", b"\n\r\n") if (place := body.find(mark)) >= 0]
    return min(places, default=-1)


def _without_footer(body: bytes, layout: TextLayout) -> tuple[bytes, tuple[Note, ...]]:
    """Return the rows without a last line that a recorder did not finish, and without lines of other kinds below."""
    start = max(0, body.rfind(b"\n", 0, max(0, len(body) - _TAIL)) + 1)
    tail = body[start:]
    lines = tail.split(b"\n")
    whole = not lines[-1].strip()
    while lines and not lines[-1].strip():
        lines.pop()
    if not whole and len(lines) > 1 and len(lines[-1]) <= LONGEST_LINE and _is_torn(lines[-1], layout):
        body = body[: len(body) - len(lines[-1])]
        return body, (Note(code="last-line-left-out", text="the last line is not whole and was left out"),)
    left: list[bytes] = []
    while len(lines) > 1 and len(left) < FOOTER_LINES and _is_footer(lines[-1], layout):
        left.insert(0, lines.pop())
    if not left:
        return body, ()
    end = start + sum(len(line) + 1 for line in lines)
    number = layout.first + body.count(b"\n", 0, end) + 1
    text = (
        f"{len(left)} lines after the table, from line {number} on ({decoded(left[0]).strip()[:30]!r}), were left out"
    )
    return body[:end], (Note(code="footer-left-out", text=text, values={"lines": len(left), "line": number}),)


def _is_torn(line: bytes, layout: TextLayout) -> bool:
    """Return whether a last line without a line end is the beginning of a row."""
    fields = split(decoded(line), layout.separator)
    if is_row(fields, layout) or _is_footer(line, layout):
        return False
    kinds = kinds_of(fields, layout.decimal)
    return len(kinds) < layout.columns or any(kind in NUMBER + GROUPED for kind in kinds)


def _is_footer(line: bytes, layout: TextLayout) -> bool:
    """Return whether a line is no row: it has a word in place of its first number, or no number at all."""
    if not line.strip() or len(line) > _TAIL:
        return not line.strip()
    text = decoded(line)
    fields = split(text, layout.separator)
    kinds = kinds_of(fields, layout.decimal)
    if len(kinds) != layout.columns:
        return kinds[0] not in NUMBER + GROUPED and not set(kinds) <= set(NUMBER + GROUPED + MISSING + OVERLOAD)
    numeric = [i for i, kind in enumerate(layout.kinds) if kind == NUMBER]
    if layout.kinds[0] == NUMBER:
        return kinds[0] not in NUMBER + GROUPED + MISSING + OVERLOAD
    return not any(kinds[i] in NUMBER + GROUPED + MISSING + OVERLOAD for i in numeric)
