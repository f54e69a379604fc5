"""Chunks of WAV files: the format of the samples and their place in the file.

The format is described by IBM and Microsoft, *Multimedia Programming Interface and Data Specifications*, its form for
large files by EBU Tech 3306 (RF64) and ITU-R BS.2088 (BW64).
"""

import struct
from dataclasses import dataclass
from typing import BinaryIO

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import check_columns, check_parts

MARKS = (b"RIFF", b"RIFX", b"RF64", b"BW64")
PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
COMPRESSED = {
    2: "ADPCM", 6: "A-law", 7: "mu-law", 0x11: "IMA ADPCM", 0x31: "GSM 6.10", 0x50: "MPEG", 0x55: "MP3", 0xFF: "AAC",
}  # fmt: skip
BYTES = {PCM: (1, 2, 3, 4, 8), FLOAT: (2, 4, 8)}
LARGEST_FORMAT = 2**16
"""Largest size of the chunks that state the format or sizes, bytes."""

_RIFF_BYTES = 2**32
"""Number of bytes that a size in RIFF cannot state."""


@dataclass(frozen=True, kw_only=True)
class WavFormat:
    """Kind of the samples, channels, rate in Hz, bytes of a sample, and their order, ``<`` or ``>``."""

    kind: int
    channels: int
    sampling_rate: int
    bytes: int
    order: str

    @property
    def each(self) -> int:
        """Bytes of a sample of all channels."""
        return self.bytes * self.channels


@dataclass(frozen=True, kw_only=True)
class WavSamples:
    """Format of the samples, the byte at which they begin, their bytes, and notes on the size that is stated."""

    form: WavFormat
    start: int
    size: int
    notes: tuple[Note, ...]


def wav_samples(file: BinaryIO, length: int) -> WavSamples:
    """Return the place of the samples in a file of so many bytes.

    Raises
    ------
    InputError
        If there are none, or their format is not read.
    """
    head = file.read(12)
    order = ">" if head[:4] == b"RIFX" else "<"
    (whole,) = struct.unpack_from(f"{order}I", head.ljust(12, b"\0"), 4)
    form: WavFormat | None = None
    in_64_bits: int | None = None
    at, parts = 12, 0
    while at + 8 <= length:
        file.seek(at)
        kind, size = struct.unpack(f"{order}4sI", file.read(8))
        start = at + 8
        if kind == b"data":
            if form is None:
                raise InputError("is damaged: its samples come before their format")
            is_64_bit = in_64_bits is not None and size == _RIFF_BYTES - 1
            stated = in_64_bits if is_64_bit and in_64_bits is not None else size
            is_closed = whole + 8 == length
            held, notes = _held(file, start, stated, length, is_64_bit=is_64_bit, is_closed=is_closed)
            return WavSamples(form=form, start=start, size=held // form.each * form.each, notes=notes)
        if kind == b"fmt ":
            form = _format(file.read(min(size, LARGEST_FORMAT)), order)
        elif kind == b"ds64":
            sizes = file.read(min(size, LARGEST_FORMAT))
            in_64_bits = int.from_bytes(sizes[8:16], "little")
        at = start + size
        if size % 2 and not _begins_chunk(file, at):  # a pad byte, which some programs leave out
            at += 1
        parts += 1
        check_parts(parts)
    raise InputError("holds no samples: it has no chunk 'data'")


def _begins_chunk(file: BinaryIO, at: int) -> bool:
    """Return whether the bytes from ``at`` on may be the kind and the size of a chunk."""
    file.seek(at)
    kind = file.read(8)
    return len(kind) == 8 and kind[:4].isascii() and kind[:4].decode("ascii").isprintable() and kind[:1].isalpha()


def _format(chunk: bytes, order: str) -> WavFormat:
    if len(chunk) < 16:
        raise InputError("is cut short: its format is not whole")
    kind, channels, rate, _, align, bits = struct.unpack_from(f"{order}HHIIHH", chunk)
    if kind == EXTENSIBLE and len(chunk) >= 26:
        (kind,) = struct.unpack_from(f"{order}H", chunk, 24)
    if kind not in BYTES:
        name = COMPRESSED.get(kind, f"of kind {kind:#x}")
        raise InputError(f"holds samples {name}, which are not read; save it as PCM")
    size = (bits + 7) // 8
    if not channels or not rate:
        raise InputError(f"is damaged: it states {channels} channels and a sampling rate of {rate} Hz")
    if size not in BYTES[kind] or align != size * channels:
        raise InputError(f"is damaged: it states {channels} channels of {bits} bits in {align} bytes")
    check_columns(channels)
    return WavFormat(kind=kind, channels=channels, sampling_rate=rate, bytes=size, order=order)


def _held(
    file: BinaryIO, start: int, stated: int, length: int, *, is_64_bit: bool, is_closed: bool
) -> tuple[int, tuple[Note, ...]]:
    """Return the bytes of the samples, and a note where the header states another number than the file holds."""
    present = length - start
    if not stated and present and not is_closed:
        return present, (_all_read(stated, present),)
    size, notes = stated_size(stated, present, is_64_bit=is_64_bit)
    after = start + size + size % 2
    if after < length and not notes and not (_begins_chunk(file, start + size) or _begins_chunk(file, after)):
        text = (
            f"the header states {size} bytes of samples, and {length - after} bytes behind them belong to no chunk and "
            "were left out; a recorder may have stopped before it wrote the header"
        )
        notes = (Note(code="bytes-left-out", text=text, values={"stated": size, "bytes": length - after}),)
    return size, notes


def stated_size(stated: int, present: int, *, is_64_bit: bool) -> tuple[int, tuple[Note, ...]]:
    """Return the bytes of samples in a file that has so many after their header.

    Sizes in RIFF have 32 bits. A recorder that writes more lets them overflow, or writes the largest number.
    """
    unknown = stated == _RIFF_BYTES - 1 and not is_64_bit
    if stated > present and not unknown:
        text = f"the file is cut short: its header states {stated} bytes of samples, it has {present}"
        return present, (Note(code="cut-short", text=text, values={"stated": stated, "bytes": present}),)
    if is_64_bit or (not unknown and present - stated < _RIFF_BYTES // 2):
        return stated, ()
    if stated and not unknown and (present - stated) % _RIFF_BYTES:
        raise InputError(
            f"has {present} bytes from the samples on, and its header states {stated}; sizes above 4 GiB need RF64, "
            "write it again so"
        )
    return present, (_all_read(stated, present),)


def _all_read(stated: int, present: int) -> Note:
    text = f"the header does not state the size of the samples; all {present} bytes to the end of the file were read"
    return Note(code="size-not-stated", text=text, values={"stated": stated, "bytes": present})
