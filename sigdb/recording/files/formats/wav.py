"""WAV: integers are read as fractions of full scale, floats unchanged."""

import io
import struct
import warnings
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    bounded_bytes,
    check_columns,
    check_values,
)
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = (
    ValueError,
    TypeError,
    ArithmeticError,
    UnboundLocalError,
    struct.error,
)


def read_wav(path: Path, settings: RecordingSettings) -> Contents:
    """Read the channels of a WAV file; the largest integer of its type becomes 1."""
    from scipy.io import wavfile  # slow to load

    data = bounded_bytes(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy warns about chunks without samples
        # From memory, no more is allocated than the file holds, whatever its header states.
        rate, samples = wavfile.read(io.BytesIO(data))
    if not samples.size:
        raise InputError("holds no samples")
    matrix = samples.reshape(len(samples), -1)
    check_columns(matrix.shape[1])
    check_values(matrix.size)
    stored, notes = _full_scale(matrix)
    stated = int.from_bytes(data[4:8], "big" if data[:4] == b"RIFX" else "little") + 8
    if len(data) < stated < 2**32:
        text = f"the file is cut short: its header states {stated} bytes, it has {len(data)}"
        notes = (*notes, Note(code="cut-short", text=text, values={"stated": stated, "bytes": len(data)}))
    columns = tuple(DataColumn(name=f"channel{i + 1}", values=stored[:, i]) for i in range(stored.shape[1]))
    return Contents(columns=columns, sampling_rate=float(rate), notes=notes, named=False)


def _full_scale(matrix: StoredArray) -> tuple[StoredArray, tuple[Note, ...]]:
    """Return the samples with full scale 1; unsigned bytes have their zero at 128."""
    if matrix.dtype.kind == "f":
        return matrix, ()
    # SciPy puts 24 bits at the top of 32.
    zero = 128 if matrix.dtype == np.uint8 else 0
    scale = float(2 ** (8 * matrix.dtype.itemsize - 1))
    note = Note(code="full-scale", text="integers of a WAV file: full scale is 1")
    return (matrix - np.float64(zero)) / scale, (note,)
