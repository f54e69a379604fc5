"""WAV: integers are read as fractions of full scale, floats unchanged."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    block_edges,
    block_length,
    bounded_bytes,
    check_values,
)
from sigdb.recording.files.formats.wav_chunks import FLOAT, MARKS, WavFormat, WavSamples, wav_samples
from sigdb.recording.files.settings import RecordingSettings

__all__ = ["FOREIGN", "MARKS", "read_wav", "wav_blocks"]

FOREIGN: tuple[type[Exception], ...] = ()


def read_wav(path: Path, settings: RecordingSettings) -> Contents:
    """Read the channels of a WAV file; the largest integer of its type becomes 1.

    Where a recorder left wrong sizes in the header, the samples up to the end of the file are read, and a note says it.
    """
    data = bounded_bytes(path)
    place = wav_samples(io.BytesIO(data), len(data))
    check_values(place.size // place.form.bytes)
    return _contents(memoryview(data)[place.start : place.start + place.size], place, settings)


def wav_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the channels of a WAV file in blocks.

    Parameters
    ----------
    path
        The file.
    settings
        Settings of reading; units are used.
    samples
        Samples of a block.
    """
    with path.open("rb") as file:
        place = wav_samples(file, path.stat().st_size)
        each = place.form.each
        for start, stop in block_edges(place.size // each, block_length(place.form.channels, samples)):
            file.seek(place.start + start * each)
            yield _contents(memoryview(file.read((stop - start) * each)), place, settings)


def _contents(held: memoryview, place: WavSamples, settings: RecordingSettings) -> Contents:
    form = place.form
    count = len(held) // form.each
    if not count:
        raise InputError("holds no samples")
    matrix = _numbers(held[: count * form.each], form).reshape(count, form.channels)
    stored, notes = _full_scale(matrix)
    columns = tuple(DataColumn(name=f"channel{i + 1}", values=stored[:, i]) for i in range(form.channels))
    notes = (*notes, *place.notes, *_unit_note(settings))
    return Contents(columns=columns, sampling_rate=float(form.sampling_rate), notes=notes, named=False)


def _numbers(held: memoryview, form: WavFormat) -> StoredArray:
    """Return the samples; those of 24 bits stand in the upper bytes of 32."""
    if form.kind == FLOAT:
        return np.frombuffer(held, f"{form.order}f{form.bytes}")
    if form.bytes == 1:
        return np.frombuffer(held, "u1")
    if form.bytes != 3:
        return np.frombuffer(held, f"{form.order}i{form.bytes}")
    parts = np.frombuffer(held, np.uint8).reshape(-1, 3)
    padded = np.zeros((len(parts), 4), np.uint8)
    padded[:, 1:] = parts if form.order == "<" else parts[:, ::-1]
    return padded.reshape(-1).view("<i4")


def _full_scale(matrix: StoredArray) -> tuple[StoredArray, tuple[Note, ...]]:
    """Return the samples with full scale 1; unsigned bytes have their zero at 128."""
    if matrix.dtype.kind == "f":
        return matrix, ()
    zero = 128 if matrix.dtype == np.uint8 else 0
    scale = float(2 ** (8 * matrix.dtype.itemsize - 1))
    note = Note(code="full-scale", text="integers of a WAV file: full scale is 1")
    return (matrix - np.float64(zero)) / scale, (note,)


def _unit_note(settings: RecordingSettings) -> tuple[Note, ...]:
    text = "a WAV file does not state the unit of its samples; give units, and scale if they are not in that unit"
    return () if settings.units is not None else (Note(code="no-unit", text=text),)
