"""Raw numbers of TDMS segments: one object after the other, interleaved, or in the buffers of DAQmx."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import InputError
from sigdb.recording.files.formats.contents import StoredArray, check_columns
from sigdb.recording.files.formats.tdms_segments import NUMBERS, OTHERS, TIMESTAMP, Index, TdmsSegment


@dataclass(frozen=True, kw_only=True)
class RawNumbers:
    """Raw numbers of an object in a segment, as a view of its bytes.

    Attributes
    ----------
    name
        Path of the object.
    scale
        Scale of DAQmx to which they belong; None for others.
    chunks
        (chunks, count) numbers in the order of time.
    bit
        Bit of each number that a digital line is; None for others.
    """

    name: str
    scale: int | None
    chunks: StoredArray
    bit: int | None = None

    @property
    def size(self) -> int:
        """Count of the numbers."""
        return self.chunks.size

    def part(self, start: int, stop: int) -> StoredArray:
        """Return the numbers from ``start`` to ``stop``; no other chunks are touched."""
        count = self.chunks.shape[1]
        if stop <= start:
            return np.zeros(0, self.chunks.dtype)
        first, last = start // count, (stop - 1) // count
        if first == last:
            values = self.chunks[first, start - first * count : stop - first * count]
        else:
            inner = self.chunks[first + 1 : last].reshape(-1)
            values = np.concatenate(
                [self.chunks[first, start - first * count :], inner, self.chunks[last, : stop - last * count]]
            )
        return values if self.bit is None else values >> self.bit & 1


def raw_numbers(segment: TdmsSegment) -> tuple[list[RawNumbers], int]:
    """Return the raw numbers of each object in a segment, and the bytes at its end that make no whole chunk.

    The numbers are views of the bytes. A segment may repeat its chunk. Time stamps become records of ``seconds`` and
    ``fraction``. Objects of other kinds, such as text, are skipped.

    Raises
    ------
    InputError
        If the objects do not fit together.
    """
    if not segment.objects or not len(segment.raw):
        return [], 0
    with_scalers = [bool(index.scalers or index.widths) for _, index in segment.objects]
    if all(with_scalers):
        return _daqmx(segment)
    if any(with_scalers):
        raise InputError("is damaged: a segment holds both raw DAQmx numbers and others")
    return _interleaved(segment) if segment.interleaved else _contiguous(segment)


def stored_type(kind: int, order: str) -> np.dtype | None:
    """Return the type of numbers or time stamps; None for a kind that is neither."""
    if kind == TIMESTAMP:
        parts = [("fraction", f"{order}u8"), ("seconds", f"{order}i8")]
        return np.dtype(parts if order == "<" else parts[::-1])
    return np.dtype(order + NUMBERS[kind]) if kind in NUMBERS else None


def _contiguous(segment: TdmsSegment) -> tuple[list[RawNumbers], int]:
    size = sum(index.size for _, index in segment.objects)
    if not 0 < size <= len(segment.raw):
        return [], len(segment.raw) if size else 0
    rest = len(segment.raw) % size
    chunks = np.frombuffer(segment.raw, np.uint8, len(segment.raw) - rest).reshape(-1, size)
    numbers, at = [], 0
    for name, index in segment.objects:
        kind = stored_type(index.kind, segment.order)
        if kind is not None and index.size:
            numbers.append(RawNumbers(name=name, scale=None, chunks=chunks[:, at : at + index.size].view(kind)))
        at += index.size
    return numbers, rest


def _interleaved(segment: TdmsSegment) -> tuple[list[RawNumbers], int]:
    """Return the numbers where one of each object follows in turn."""
    kinds = [stored_type(index.kind, segment.order) for _, index in segment.objects]
    if any(kind is None for kind in kinds):
        raise InputError("is damaged: other things than numbers are interleaved")
    if len({index.count for _, index in segment.objects}) > 1:
        raise InputError("is damaged: interleaved channels have different counts of numbers")
    check_columns(len(kinds))
    row = np.dtype([(f"f{i}", kind) for i, kind in enumerate(kinds)])
    rest = len(segment.raw) % row.itemsize
    table = np.frombuffer(segment.raw, row, len(segment.raw) // row.itemsize)
    objects = enumerate(segment.objects)
    return [RawNumbers(name=name, scale=None, chunks=table[f"f{i}"][None]) for i, (name, _) in objects], rest


def _daqmx(segment: TdmsSegment) -> tuple[list[RawNumbers], int]:
    """Return the numbers of each scale: each buffer of a chunk holds rows of a stated width."""
    indices = [index for _, index in segment.objects]
    widths = indices[0].widths
    if any(index.widths != widths for index in indices):
        raise InputError("is damaged: raw DAQmx numbers state different buffers in one segment")
    rows = [_rows(indices, buffer) for buffer in range(len(widths))]
    sizes = [count * width for count, width in zip(rows, widths, strict=True)]
    if not sum(sizes):
        return [], 0
    if sum(size > 0 for size in sizes) == 1:  # rows follow each other, so a part of a chunk is whole rows too
        width = next(width for size, width in zip(sizes, widths, strict=True) if size)
        chunks, rest = len(segment.raw) // width, len(segment.raw) % width
        sizes = [width if size else 0 for size in sizes]
    else:
        chunks, rest = divmod(len(segment.raw), sum(sizes))
    if not chunks:
        return [], rest
    table = np.frombuffer(segment.raw, np.uint8, chunks * sum(sizes)).reshape(chunks, -1)
    starts = np.cumsum([0, *sizes])
    buffers = [table[:, starts[i] : starts[i + 1]] for i in range(len(sizes))]
    numbers = []
    for name, index in segment.objects:
        for scaler in index.scalers:
            rows_of_bytes = buffers[scaler.buffer].reshape(chunks, -1, widths[scaler.buffer])
            part = rows_of_bytes[:, :, scaler.byte : scaler.byte + int(scaler.kind[1])]
            view: StoredArray = part.view(segment.order + scaler.kind)[:, :, 0]
            # Chunks of a row each are one chunk of all rows.
            view = view.T if view.shape[1] == 1 else view
            numbers.append(RawNumbers(name=name, scale=scaler.scale, chunks=view, bit=scaler.bit))
    return numbers, rest


def _rows(indices: list[Index], buffer: int) -> int:
    """Return how many rows a buffer has in a chunk."""
    counts = {index.count for index in indices if any(scaler.buffer == buffer for scaler in index.scalers)}
    if len(counts) > 1:
        raise InputError("is damaged: raw DAQmx numbers of one buffer have different counts")
    return counts.pop() if counts else 0


def kind_in_words(kind: int) -> str:
    """Return the kind of an object that holds no numbers, in words."""
    return OTHERS.get(kind, "no numbers")
