"""WAV: integers are read as fractions of full scale, floats unchanged."""

import io
import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import (
    Contents,
    DataColumn,
    StoredArray,
    block_edges,
    block_length,
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


MOST_CHUNKS = 10_000
"""Largest number of chunks before the samples."""

LARGEST_FORMAT = 2**16
"""Largest size of the chunk that states the format, bytes."""

_RIFF_BYTES = 2**32
"""Number of bytes that a size in RIFF cannot state."""


def read_wav(path: Path, settings: RecordingSettings) -> Contents:
    """Read the channels of a WAV file; the largest integer of its type becomes 1."""
    data = bounded_bytes(path)
    contents = _contents(data)
    check_values(sum(column.values.size for column in contents.columns))
    stated = int.from_bytes(data[4:8], "big" if data[:4] == b"RIFX" else "little") + 8
    if len(data) < stated < _RIFF_BYTES:
        return replace(contents, notes=(*contents.notes, _cut_short(stated, len(data))))
    return contents


def wav_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the channels of a WAV file in blocks.

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
        place = _samples_place(file, path.stat().st_size)
        total = place.size // place.each
        for start, stop in block_edges(total, block_length(place.channels, samples)):
            file.seek(place.start + start * place.each)
            data = file.read((stop - start) * place.each)
            data = data[: len(data) // place.each * place.each]
            chunks = b"".join([b"WAVEfmt ", place.format, b"data", len(data).to_bytes(4, place.order), data])
            contents = _contents(place.mark + len(chunks).to_bytes(4, place.order) + chunks)
            yield replace(contents, notes=(*contents.notes, *place.notes))


@dataclass(frozen=True, kw_only=True)
class _SamplesPlace:
    """Place of the samples in a file: first byte, bytes, bytes of a sample of all channels, and what states them."""

    start: int
    size: int
    each: int
    channels: int
    mark: bytes
    format: bytes
    order: Literal["big", "little"]
    notes: tuple[Note, ...]


def _samples_place(file: BinaryIO, end: int) -> _SamplesPlace:
    """Return the place of the samples, from the chunks before them."""
    mark = file.read(12)[:4]
    order: Literal["big", "little"] = "big" if mark == b"RIFX" else "little"
    format_chunk, size_of_format, in_64_bits = b"", b"", None
    for _ in range(MOST_CHUNKS):
        name, size = file.read(4), file.read(4)
        stated, start = int.from_bytes(size, order), file.tell()
        if len(size) < 4:
            break
        if name == b"data":
            if len(format_chunk) < 16:
                break
            stated = stated if in_64_bits is None else in_64_bits
            bytes_, notes = stated_size(stated, end - start, is_64_bit=in_64_bits is not None)
            channels, each = (int.from_bytes(format_chunk[i : i + 2], order) for i in (2, 12))
            if not channels or not each:
                raise InputError(f"states {channels} channels in {each} bytes a sample; it is damaged")
            check_columns(channels)
            return _SamplesPlace(
                start=start, size=bytes_, each=each, channels=channels, mark=b"RIFX" if order == "big" else b"RIFF",
                format=size_of_format + format_chunk, order=order, notes=notes,
            )  # fmt: skip
        if name == b"fmt ":
            if stated > LARGEST_FORMAT:
                break
            format_chunk, size_of_format = file.read(stated), size
        elif name == b"ds64":
            in_64_bits = int.from_bytes(file.read(stated)[8:16], "little") if stated <= LARGEST_FORMAT else None
        file.seek(start + stated + stated % 2)
    raise InputError("holds no samples, or does not state their format; it is damaged")


def stated_size(stated: int, present: int, *, is_64_bit: bool) -> tuple[int, tuple[Note, ...]]:
    """Return the bytes of samples in a file that has so many after their header.

    Sizes in RIFF have 32 bits. A recorder that writes more lets them overflow, or writes the largest number.
    """
    unknown = stated == _RIFF_BYTES - 1 and not is_64_bit
    if stated > present:
        return present, () if unknown else (_cut_short(stated, present),)
    if is_64_bit or (not unknown and present - stated < _RIFF_BYTES // 2):
        return stated, ()
    if stated and not unknown and (present - stated) % _RIFF_BYTES:
        raise InputError(
            f"has {present} bytes from the samples on, and its header states {stated}; sizes above 4 GiB need RF64, "
            "write it again so"
        )
    text = f"the header cannot state the size of the samples; all {present} bytes to the end of the file were read"
    return present, (Note(code="size-above-4-gib", text=text, values={"stated": stated, "bytes": present}),)


def _cut_short(stated: int, size: int) -> Note:
    text = f"the file is cut short: its header states {stated} bytes, it has {size}"
    return Note(code="cut-short", text=text, values={"stated": stated, "bytes": size})


def _contents(data: bytes) -> Contents:
    """Return the channels of a WAV file."""
    from scipy.io import wavfile  # slow to load

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy warns about chunks without samples
        # From memory, no more is allocated than the file holds, whatever its header states.
        rate, samples = wavfile.read(io.BytesIO(data))
    if not samples.size:
        raise InputError("holds no samples")
    matrix = samples.reshape(len(samples), -1)
    check_columns(matrix.shape[1])
    stored, notes = _full_scale(matrix)
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
