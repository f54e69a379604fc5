"""WAV: integers as fractions of full scale, floats as they are."""

import io
import warnings
from pathlib import Path

import numpy as np

from sigdb.core.errors import InputError
from sigdb.measurement.readers.contents import Column, Contents
from sigdb.measurement.readers.limits import bounded_bytes, check_columns, check_values
from sigdb.measurement.recording_settings import RecordingSettings

FOREIGN: tuple[type[Exception], ...] = (ValueError, TypeError, ArithmeticError, UnboundLocalError, MemoryError)


def read_wav(path: Path, settings: RecordingSettings) -> Contents:
    """Channels of a WAV file; the largest integer of its type is 1."""
    from scipy.io import wavfile  # slow to load

    data = bounded_bytes(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of chunks that hold no samples
        # From memory, no more is allocated than the file holds, whatever its header says.
        rate, samples = wavfile.read(io.BytesIO(data))
    matrix = np.asarray(samples).reshape(len(samples), -1)
    if not len(matrix):
        raise InputError("holds no samples")
    check_columns(matrix.shape[1])
    check_values(matrix.size)
    stored, note = _full_scale(matrix)
    columns = tuple(Column(name=f"channel{i + 1}", values=stored[:, i]) for i in range(stored.shape[1]))
    return Contents(columns=columns, sampling_rate=float(rate), notes=note, named=False)


def _full_scale(matrix: "np.ndarray[tuple[int, int], np.dtype[np.generic]]") -> tuple["np.ndarray", tuple[str, ...]]:
    """Samples with full scale 1; bytes of 8 bits have their zero at 128."""
    if matrix.dtype.kind == "f":
        return matrix, ()
    if matrix.dtype == np.uint8:
        return (matrix.astype(float) - 128) / 128, ("integers of a WAV file: full scale is 1",)
    scale = float(2 ** (8 * matrix.dtype.itemsize - 1))
    return matrix / scale, ("integers of a WAV file: full scale is 1",)
