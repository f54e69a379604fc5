"""Records along the lines of a text: an identifier, then all samples of a wave."""

import io
import re
from itertools import islice

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.files.formats.contents import MAX_CHANNELS, Contents, DataColumn, check_columns, check_values
from sigdb.recording.files.formats.text.encoding import decoded

SHORTEST_RECORD = 64
"""Smallest number of samples in a line that is a record."""

_SEPARATORS = (b";", b"\t", b",", b" ")
_HEADER_BYTES = 400
_ID = re.compile(rb'\s*"?([^;,\t"]{1,60}?)"?\s*$')
_NUMBER = re.compile(rb"[+-]?[0-9]*([.,]?)[0-9]+([eE][+-]?[0-9]+)?")


def records(data: bytes) -> Contents | None:
    """Return the records of a text, each of them a column; None if its lines are no records.

    A record is a line with an identifier and at least ``SHORTEST_RECORD`` numbers. There are fewer records than
    numbers in each.

    Raises
    ------
    InputError
        If a record holds something that is no number.
    """
    lines = [line.strip() for line in islice(_lines(data), 4) if line.strip()]
    if not lines or not any(len(line) > 2 * SHORTEST_RECORD for line in lines[:2]):
        return None
    header = len(lines) > 1 and len(lines[0]) < _HEADER_BYTES and len(lines[0]) * 8 < len(lines[1])
    first = lines[1] if header else lines[0]
    if header and any(len(re.split(rb"[;,\t]", lines[0])) > most for most in (3,)):
        return None
    signs = _signs(first)
    if signs is None:
        return None
    front, separator = signs
    if not _has_identifier(first, front, separator, header=header):
        return None
    count = data.count(b"\n") + 1
    if count > first.count(separator) or count > MAX_CHANNELS + 1:
        return None
    check_values(data.count(separator))
    columns: list[DataColumn] = []
    for number, line in enumerate(_lines(data)):
        if line.strip() and (columns or not header or number > 0):
            name, _, wave = line.strip().partition(front)
            columns.append(DataColumn(name=_name(name), values=_samples(wave, separator, number=number + 1)))
    check_columns(len(columns))
    text = f"{len(columns)} records, each a line of an identifier and samples, were read as channels"
    return Contents(
        columns=tuple(columns), notes=(Note(code="records-along-lines", text=text, values={"records": len(columns)}),)
    )


def _lines(data: bytes) -> "list[bytes] | _LineIterator":
    return _LineIterator(data)


class _LineIterator:
    """Lines of a text, one at a time."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def __iter__(self) -> "_LineIterator":
        return self

    def __next__(self) -> bytes:
        if self.at > len(self.data):
            raise StopIteration
        end = self.data.find(b"\n", self.at)
        end = len(self.data) if end < 0 else end
        line, self.at = self.data[self.at : end], end + 1
        return line


def _signs(line: bytes) -> tuple[bytes, bytes] | None:
    """Return the sign after the identifier and that between samples."""
    separator = next((sign for sign in _SEPARATORS if line.count(sign) >= SHORTEST_RECORD), None)
    if separator is None:
        return None
    first = line.split(separator, 1)[0]
    front = next(
        (sign for sign in _SEPARATORS if sign != separator and sign in first.strip() and sign != b" "), separator
    )
    return front, separator


def _has_identifier(line: bytes, front: bytes, separator: bytes, *, header: bool) -> bool:
    """Return whether the first field is no sample: a word, or a whole number before decimal ones."""
    name, _, wave = line.partition(front)
    fields = [field.strip() for field in wave[:4096].split(separator)[:-1] if field.strip()]
    if _ID.match(name) is None or not fields or not all(_NUMBER.fullmatch(field.strip(b'"')) for field in fields):
        return False
    word = name.strip().strip(b'"')
    if front != separator or header or not _NUMBER.fullmatch(word):
        return b":" not in word
    fractions = sum(not field.lstrip(b"+-").isdigit() for field in fields)
    return word.isdigit() and 2 * fractions > len(fields)


def _name(name: bytes) -> str:
    return decoded(name).strip().strip('"').strip()


def _samples(wave: bytes, separator: bytes, *, number: int) -> FloatArray:
    """Return the samples of a line."""
    import pyarrow as pa
    from pyarrow import csv

    wave = wave.strip().strip(b'"').strip().removesuffix(separator)
    comma = separator != b"," and b"," in wave and b"." not in wave
    if separator == b" ":
        wave = re.sub(rb" +", b" ", wave)
    if separator * 2 in wave or not wave:
        raise InputError(f"line {number}: a sample of the record is missing; mend it, or remove the line")
    try:
        read = csv.read_csv(
            io.BytesIO(wave.replace(separator, b"\n") + b"\n"),
            read_options=csv.ReadOptions(column_names=["x"], use_threads=False),
            parse_options=csv.ParseOptions(delimiter="\t"),
            convert_options=csv.ConvertOptions(column_types={"x": pa.float64()}, decimal_point="," if comma else "."),
        )
    except pa.ArrowInvalid as error:
        value = re.search(r"invalid value '(.*)'", str(error), re.DOTALL)
        shown = repr(value[1][:40]) if value else "a field"
        raise InputError(f"line {number}: {shown} of the record is not a number; mend it, or remove the line") from None
    return read.column("x").to_numpy()
