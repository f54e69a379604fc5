"""WAV: integers as fractions of full scale, floats as they are."""

import io
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import Contents, DataColumn, bounded_bytes, check_columns, check_values
from sigdb.recording.files.settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = (
    ValueError,
    TypeError,
    ArithmeticError,
    UnboundLocalError,
    struct.error,
)


def read_wav(path: Path, settings: RecordingSettings) -> Contents:
    """Channels of a WAV file; the largest integer of its type is 1."""
    from scipy.io import wavfile  # slow to load

    data = bounded_bytes(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of chunks that hold no samples
        # From memory, no more is allocated than the file holds, whatever its header says.
        rate, samples = wavfile.read(io.BytesIO(data))
    if not samples.size:
        raise InputError("holds no samples")
    matrix = samples.reshape(len(samples), -1)
    check_columns(matrix.shape[1])
    check_values(matrix.size)
    stored, note = _full_scale(matrix)
    told = int.from_bytes(data[4:8], "big" if data[:4] == b"RIFX" else "little") + 8
    if len(data) < told < 2**32:
        note = (*note, f"the file is cut short: its header says {told} bytes, it has {len(data)}")
    columns = tuple(DataColumn(name=f"channel{i + 1}", values=stored[:, i]) for i in range(stored.shape[1]))
    return Contents(columns=columns, sampling_rate=float(rate), notes=note, named=False)


def _full_scale(matrix: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], tuple[str, ...]]:
    """Samples with full scale 1; bytes have their zero at 128."""
    if matrix.dtype.kind == "f":
        return matrix, ()
    # SciPy puts 24 bits at the top of 32.
    zero = 128 if matrix.dtype == np.uint8 else 0
    scale = float(2 ** (8 * matrix.dtype.itemsize - 1))
    return (matrix - np.float64(zero)) / scale, ("integers of a WAV file: full scale is 1",)
