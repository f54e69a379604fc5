"""Numbers of data sets 58 as text: in fields of a fixed width, which may touch, or between blanks."""

import re
from collections.abc import Iterator

import numpy as np

from sigdb.core import FloatArray, InputError

CHUNK = 2**22
"""Bytes of text that are converted at once."""

_SIGNED = re.compile(rb"[+-]?\d*\.\d*[EeDd][+-]\d{2,3}(?=[\s+-]|\Z)")
_NO_LETTER = re.compile(rb"(\d\.\d*|\.\d+)([+-]\d{3}\s*)$")


def text_numbers(body: bytes, widths: tuple[int, ...], count: int, name: str) -> FloatArray:
    """Return the numbers of a data set.

    Parameters
    ----------
    body
        Lines of numbers.
    widths
        Widths of the fields of a line in signs, as the data set prescribes them; blanks between them are not.
    count
        Numbers that the data set states.
    name
        Name of the data set in messages.

    Raises
    ------
    InputError
        If there are other things than numbers, or another count of them.
    """
    for convert in (_between_blanks, _in_fields, _signed):
        pieces = [convert(piece, widths) for piece in _pieces(body)]
        if any(piece is None for piece in pieces):
            continue
        numbers = np.concatenate([np.zeros(0), *(piece for piece in pieces if piece is not None)])
        if numbers.size < count:
            raise InputError(f"{name} is cut short: it states {count} numbers and holds {numbers.size}")
        if numbers.size >= count + len(widths):
            raise InputError(f"{name} states {count} numbers and holds {numbers.size}; write the file again")
        return numbers[:count]
    raise InputError(f"{name} holds other things than numbers; write the file again")


def _pieces(body: bytes) -> Iterator[bytes]:
    at = 0
    while at < len(body):
        end = body.find(b"\n", at + CHUNK)
        end = len(body) if end < 0 else end + 1
        yield body[at:end]
        at = end


def _between_blanks(text: bytes, widths: tuple[int, ...]) -> FloatArray | None:
    try:
        return np.array(text.split(), dtype=float)
    except ValueError:
        return None


def _in_fields(text: bytes, widths: tuple[int, ...]) -> FloatArray | None:
    """Return numbers in fields; each ends where its field ends, so that a line without its indent is known too."""
    ends = np.cumsum(widths)
    lines = [line for line in (row.rstrip() for row in text.splitlines()) if line]
    numbers: list[bytes] = []
    for line in lines:
        fields = int(np.searchsorted(ends, len(line))) + 1
        if fields > ends.size:
            return None
        whole = line.rjust(ends[fields - 1])
        starts = [0, *ends[: fields - 1].tolist()]
        numbers += [_with_letter(whole[start:end]) for start, end in zip(starts, ends.tolist(), strict=False)]
    try:
        return np.array(numbers, dtype=float)
    except ValueError:
        return None


def _with_letter(field: bytes) -> bytes:
    """Return a number with the E that Fortran leaves out before an exponent of three digits, or writes as D."""
    return _NO_LETTER.sub(rb"\1E\2", field.upper().replace(b"D", b"E"))


def _signed(text: bytes, widths: tuple[int, ...]) -> FloatArray | None:
    """Return numbers with exponents that touch only where the next one has a sign."""
    numbers = _SIGNED.findall(text)
    if b"".join(numbers) != b"".join(text.split()):
        return None
    try:
        return np.array([_with_letter(number) for number in numbers], dtype=float)
    except ValueError:
        return None
