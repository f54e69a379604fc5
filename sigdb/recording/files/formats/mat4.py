"""MAT-files of version 4: matrices of numbers and texts."""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sigdb.core import InputError, NotApplicableError
from sigdb.recording.files.formats.contents import Contents, StoredArray, bounded_bytes, check_values
from sigdb.recording.files.formats.matlab_values import ObjectArrays, ObjectReference, Unread, Value, Workspace
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = ()

PRECISIONS = ("f8", "f4", "i4", "i2", "u2", "u1")
"""Types of numbers, by the third digit of a matrix's type."""

TEXT, SPARSE = 1, 2
HEADER = 20
LONGEST_NAME = 256
_NAME = re.compile(rb"[A-Za-z_]\w*\0*")


@dataclass(frozen=True, kw_only=True)
class MatrixHeader:
    """The header of a matrix; ``order`` is ``<`` or ``>``."""

    order: str
    precision: int
    kind: int
    rows: int
    columns: int
    is_complex: bool
    name_length: int


def header_of(data: bytes) -> MatrixHeader | None:
    """Return the header at the start of some bytes; None if there is none.

    Examples
    --------
    >>> header_of(struct.pack("<5i", 0, 100, 1, 0, 3) + b"a1").rows
    100
    """
    if len(data) < HEADER:
        return None
    for order, machine in (("<", 0), (">", 1)):
        kind, rows, columns, is_complex, name_length = struct.unpack(f"{order}5i", data[:HEADER])
        thousands, digits = divmod(kind, 1000)
        precision, matrix_kind = divmod(digits, 10)
        if (
            thousands == machine
            and precision < len(PRECISIONS)
            and matrix_kind <= SPARSE
            and min(rows, columns) >= 0
            and is_complex in (0, 1)
            and 2 <= name_length <= LONGEST_NAME
        ):
            return MatrixHeader(
                order=order, precision=precision, kind=matrix_kind, rows=rows, columns=columns,
                is_complex=bool(is_complex), name_length=name_length,
            )  # fmt: skip
    return None


def begins_like_mat4(begin: bytes) -> bool:
    """Return whether a file begins with the header of a matrix and the name of a variable."""
    header = header_of(begin)
    return header is not None and _name_bytes(begin, header) is not None


def read_mat4(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of all matrices of numbers."""
    workspace = Workspace()
    for name, value in _matrices(bounded_bytes(path)):
        workspace.add(name, value)
    return workspace.contents(_no_object, variable=settings.variable)


def _matrices(data: bytes) -> Iterator[tuple[str, Value]]:
    at = 0
    while at < len(data):
        header = header_of(data[at : at + HEADER])
        stored_name = None if header is None else _name_bytes(data[at : at + HEADER + LONGEST_NAME], header)
        if header is None or stored_name is None:
            raise InputError(f"is damaged: no matrix begins at byte {at} of {len(data)}")
        name = stored_name.rstrip(b"\0").decode("ascii")
        at += HEADER + header.name_length
        count = header.rows * header.columns
        check_values(count)
        dtype = np.dtype(f"{header.order}{PRECISIONS[header.precision]}")
        parts = 2 if header.is_complex else 1
        size = count * dtype.itemsize * parts
        if size > len(data) - at:
            raise InputError(f"is cut short: {name} has {size} bytes, {len(data) - at} are left")
        yield name, _value(np.frombuffer(data, dtype, count * parts, at), header)
        at += size


def _value(numbers: StoredArray, header: MatrixHeader) -> Value:
    count = header.rows * header.columns
    if header.kind == SPARSE:
        return Unread("a sparse matrix")
    if header.kind == TEXT:
        codes = numbers[:count].astype(float) if header.rows == 1 else np.zeros(0)
        return "".join(chr(int(code)) for code in codes[:LONGEST_NAME] if 0 < code < 2**16)
    values = numbers[:count] + 1j * numbers[count:] if header.is_complex else numbers
    return values.reshape((header.rows, header.columns), order="F")


def _name_bytes(data: bytes, header: MatrixHeader) -> bytes | None:
    """Return the name after a header; None if it is no name of a variable."""
    name = data[HEADER : HEADER + header.name_length]
    return name if len(name) == header.name_length and _NAME.fullmatch(name) else None


def _no_object(name: str, reference: ObjectReference) -> ObjectArrays:
    raise NotApplicableError(f"version 4 holds no {reference.class_name}")
