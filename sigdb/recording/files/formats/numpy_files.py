"""NPY and NPZ files of numbers; pickled objects are not read."""

import io
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    StoredArray,
    block_edges,
    block_length,
    bounded_bytes,
    check_columns,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.formats.named_arrays import ArrayFacts, contents_of_arrays, not_read
from sigdb.recording.files.formats.time_ticks import seconds_of_times
from sigdb.recording.files.settings import RecordingSettings

LONGEST_TEXT = 4000
"""Largest size of a text that may state a fact about a recording, bytes."""

LONGEST_HEADER = 10_000
"""Largest size of the header of an array in bytes, as in NumPy."""

FOREIGN: tuple[type[Exception], ...] = (
    ValueError, EOFError, SyntaxError, RuntimeError, MemoryError, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def read_npy(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of one array as ``column1``, ``column2``, ..., or its fields by their names."""
    return _contents(_array(bounded_bytes(path)))


def npy_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the columns of one array in blocks; samples run along the longer axis.

    Parameters
    ----------
    path
        The file.
    settings
        Not used.
    samples
        Samples of a block.
    """
    with path.open("rb") as file:
        header = _file_header(file)
        if not isinstance(header, str):
            shape, fortran, dtype, place = header
            _check_size(shape, dtype, path.stat().st_size - place)
    if isinstance(header, str) or not all(shape):
        yield _contents(header if isinstance(header, str) else np.empty(shape, dtype))
        return
    stored = np.memmap(path, dtype, "r", place, shape or (1,), "F" if fortran else "C")
    if stored.dtype.kind == "M" or (
        stored.dtype.names and any(stored.dtype[i].kind == "M" for i in stored.dtype.names)
    ):
        raise InputError("holds dates, which are not read in blocks; write times in s, or cut it into shorter parts")
    values: StoredArray = np.squeeze(stored)
    if values.ndim > 2 or (values.ndim == 2 and values.dtype.names):
        raise InputError(f"holds an array of shape {stored.shape}, which is neither a series nor a matrix of columns")
    wide = values.ndim == 2 and values.shape[1] > values.shape[0]
    columns = len(values.dtype.names or ()) or (values.size // max(values.shape, default=1))
    check_columns(columns)
    for start, stop in block_edges(max(values.shape, default=1), block_length(columns, samples)):
        yield _contents(np.array(values[:, start:stop] if wide else values[start:stop]))


def _contents(values: StoredArray | str) -> Contents:
    arrays = _NamedArrays()
    arrays.take("", values)
    named = "column" not in arrays.arrays
    return contents_of_arrays(arrays.arrays, left_out=tuple(arrays.left_out), facts=arrays.facts, named=named)


def read_npz(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of all arrays of numbers; fields of an array are ``array.field``."""
    data = bounded_bytes(path)
    arrays = _NamedArrays()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        check_parts(len(members))
        check_ratio(sum(member.file_size for member in members), len(data))
        names = set()
        for member in members:
            name = member.filename.removesuffix(".npy")
            if name in names:
                raise InputError(f"holds the array {name} twice; write it again with different names")
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise InputError(f"holds {name} in a compression that NumPy does not write")
            names.add(name)
            arrays.take(name, _array(archive.read(member)) if member.filename.endswith(".npy") else "no array")
    return contents_of_arrays(
        arrays.arrays,
        variable=settings.variable,
        left_out=tuple(arrays.left_out),
        facts=arrays.facts,
        texts=arrays.texts,
    )


class _NamedArrays:
    """Arrays of numbers by name, texts, and notes on the other arrays."""

    def __init__(self) -> None:
        self.arrays: dict[str, StoredArray] = {}
        self.facts: dict[str, ArrayFacts] = {}
        self.texts: dict[str, str] = {}
        self.left_out: list[Note] = []

    def take(self, name: str, values: StoredArray | str) -> None:
        """Take an array and its fields; ``values`` may be words for other content."""
        if isinstance(values, str):
            self.left_out.append(not_read(name or "it", values))
        elif values.dtype.names:
            check_columns(len(values.dtype.names))
            for field in values.dtype.names:
                self.take(f"{name}.{field}" if name else field, values[field])
        elif values.dtype.kind in "Mm":
            self._keep(name, seconds_of_times(values), ArrayFacts(unit="s"))
        elif values.dtype.kind in "biufc":
            self._keep(name, values, ArrayFacts())
        elif values.dtype.kind in "US" and values.size == 1 and values.dtype.itemsize <= LONGEST_TEXT:
            text = values.reshape(()).item()
            self.texts[name] = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
        else:
            self.left_out.append(not_read(name or "it", _words(values.dtype)))

    def _keep(self, name: str, values: StoredArray, facts: ArrayFacts) -> None:
        self.arrays[name or "column"] = values
        self.facts[name or "column"] = facts


def _words(dtype: np.dtype) -> str:
    return f"an array of {'Python objects' if dtype.hasobject else dtype}, not of numbers"


def _array(data: bytes) -> StoredArray | str:
    """Return the array of an NPY file, or words for its other content; no more is allocated than the file holds."""
    header = _file_header(io.BytesIO(data))
    if isinstance(header, str):
        return header
    shape, fortran, dtype, place = header
    count = int(np.prod(shape, dtype=object))
    check_values(max(count, 0))
    _check_size(shape, dtype, len(data) - place)
    values = np.frombuffer(data, dtype, count, place)
    return values.reshape(shape, order="F" if fortran else "C")


def _file_header(file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype, int] | str:
    """Return the shape of an array, whether it lies in Fortran's order, its type, and the place of its first byte."""
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0), (3, 0)):
        raise InputError(f"is of NPY version {version}; write it again with numpy.save")
    if version == (3, 0):  # as version 2, in UTF-8
        size = int.from_bytes(file.read(4), "little")
        header = file.read(min(size, LONGEST_HEADER)).decode("utf-8").encode("latin-1", "backslashreplace")
        place = 12 + size
        shape, fortran, dtype = np.lib.format.read_array_header_2_0(
            io.BytesIO(len(header).to_bytes(4, "little") + header)
        )
    else:
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = read(file)
        place = file.tell()
    if dtype.hasobject or not dtype.itemsize:
        return _words(dtype)
    return shape, fortran, dtype, place


def _check_size(shape: tuple[int, ...], dtype: np.dtype, present: int) -> None:
    """Refuse a shape that no array has, or one that needs more bytes than are present."""
    if any(length < 0 for length in shape):
        raise InputError(f"says that it holds an array of shape {shape}")
    needed = int(np.prod(shape, dtype=object)) * dtype.itemsize
    if present < needed:
        raise InputError(f"is cut short: an array of shape {shape} needs {needed} bytes")
