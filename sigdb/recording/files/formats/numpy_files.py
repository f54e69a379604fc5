"""NPY and NPZ files of numbers; pickled objects are not read."""

import io
import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    StoredArray,
    bounded_bytes,
    check_parts,
    check_ratio,
    check_values,
)
from sigdb.recording.files.formats.named_arrays import contents_of_arrays, not_read
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = (
    ValueError, EOFError, SyntaxError, RuntimeError, MemoryError, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def read_npy(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of one array as ``column1``, ``column2``, ..."""
    values = _array(bounded_bytes(path))
    if isinstance(values, str):
        raise InputError(f"holds {values}")
    return contents_of_arrays({"column": values}, named=False)


def read_npz(path: Path, settings: RecordingSettings) -> Contents:
    """Read the columns of all arrays of numbers."""
    data = bounded_bytes(path)
    arrays: dict[str, StoredArray] = {}
    left_out: list[Note] = []
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        check_parts(len(members))
        check_ratio(sum(member.file_size for member in members), len(data))
        for member in members:
            name = member.filename.removesuffix(".npy")
            if name in arrays:
                raise InputError(f"holds the array {name} twice; write it again with different names")
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise InputError(f"holds {name} in a compression that NumPy does not write")
            values = _array(archive.read(member)) if member.filename.endswith(".npy") else "no array"
            if isinstance(values, str):
                left_out.append(not_read(name, values))
            else:
                arrays[name] = values
    return contents_of_arrays(arrays, variable=settings.variable, left_out=tuple(left_out))


def _array(data: bytes) -> StoredArray | str:
    """Return the array of an NPY file, or words for its other content; no more is allocated than the file holds."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise InputError(f"is of NPY version {version}; write it again with numpy.save")
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = read(file)
    if dtype.kind not in "biufc":
        return f"an array of {'Python objects' if dtype.hasobject else dtype}, not of numbers"
    if any(length < 0 for length in shape):
        raise InputError(f"says that it holds an array of shape {shape}")
    count = int(np.prod(shape, dtype=object))
    check_values(count)
    if len(data) - file.tell() < count * dtype.itemsize:
        raise InputError(f"is cut short: an array of shape {shape} needs {count * dtype.itemsize} bytes")
    values = np.frombuffer(data, dtype, count, file.tell())
    return values.reshape(shape, order="F" if fortran else "C")
