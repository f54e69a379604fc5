"""LabVIEW measurement files that are read in blocks of rows."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import SHORTEST_BLOCK, Contents, block_length, check_columns
from sigdb.recording.files.formats.lvm import (
    END_MARK,
    LvmHead,
    LvmSegment,
    header_facts,
    joined_segments,
    lvm_head,
    lvm_segment,
)
from sigdb.recording.files.formats.text.encoding import TextStream, decoded, encoded_text
from sigdb.recording.files.settings import RecordingSettings

_READ = 2**22
"""Bytes that are read at a time."""

_MOST_HELD = 2**29
"""Largest number of bytes of a block of rows."""

_LEAP = 2
"""Distance of a stored time from the one that Delta_X gives, in steps, from which on they contradict each other."""


def lvm_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the channels of a LabVIEW measurement file in blocks; segments that continue each other are joined.

    Parameters
    ----------
    path
        The file.
    settings
        Settings of reading; the sampling rate is used.
    samples
        Rows of a block.
    """
    with path.open("rb") as stored:
        parts = _Parts(_Rows(TextStream(stored)), samples)
        ready: list[LvmSegment] = []
        waiting: list[LvmSegment] = []
        starts: tuple[float, ...] = ()
        for part in parts:
            starts = starts or part.starts
            waiting.append(part)
            if sum(map(_size, waiting)) < parts.length:
                continue
            if ready:
                yield _contents(ready, starts, settings, parts.rows.notes)
            ready, waiting = waiting, []
        if not ready and not waiting:
            raise InputError("holds no segment with samples")
        if ready and sum(map(_size, waiting)) < SHORTEST_BLOCK:
            ready, waiting = ready + waiting, []
        for last in (ready, waiting):
            if last:
                yield _contents(last, starts, settings, parts.rows.notes)


def _size(part: LvmSegment) -> int:
    return max(x.size for x in part.values)


def _contents(
    parts: list[LvmSegment], starts: tuple[float, ...], settings: RecordingSettings, encoding: dict[str, Note]
) -> Contents:
    """Return the columns of parts of segments; ``starts`` are those of the file."""
    columns, _ = joined_segments(parts, min(starts))
    check_columns(len(columns))
    notes = tuple(encoding.values())
    if settings.sampling_rate is None:
        return Contents(columns=columns, notes=notes)
    of_file = (start - min(starts) for start in starts)
    columns = tuple(replace(column, start=start) for column, start in zip(columns, of_file, strict=True))
    return Contents(columns=columns, notes=notes, starts_of_file=True)


@dataclass
class _Rows:
    """Lines of a text; ``line`` is the number of those before the held ones."""

    file: TextStream
    held: bytes = b""
    line: int = 0
    notes: dict[str, Note] = field(default_factory=dict)

    def more(self) -> bool:
        """Read on, and return whether there was more."""
        data = self.file.read(_READ)
        self.held += data
        if len(self.held) > _MOST_HELD:
            raise InputError(f"holds a segment header or block of more than {_MOST_HELD} bytes; cut it")
        return bool(data)

    def take(self, size: int) -> bytes:
        """Return the next bytes, which end a line."""
        part, self.held = self.held[:size], self.held[size:]
        self.line += part.count(b"\n")
        if not part.strip():
            return part
        data, notes = encoded_text(part)
        self.notes |= {note.code: note for note in notes}
        return data

    def ends(self, lines: int, size: int) -> int:
        """Return the bytes of the first lines among the first ``size`` bytes."""
        places = np.flatnonzero(np.frombuffer(self.held, np.uint8, size) == ord("\n"))
        return int(places[lines - 1]) + 1


@dataclass
class _Parts:
    """Parts of the segments of a file, each of about as many rows as a block, with starts of their own."""

    rows: _Rows
    samples: int | None
    length: int = 0

    def __iter__(self) -> Iterator[LvmSegment]:
        rows = self.rows
        while len(rows.held) < _READ and rows.more():
            pass
        text = encoded_text(rows.held)[0]
        head = lvm_head(text)
        rows.take(rows.ends(text.count(b"\n", 0, head.size), len(rows.held)))
        while (header := self._header(head)) is not None:
            facts, heads = header
            self.length = self.length or block_length(len(heads), self.samples)
            yield from self._of_segment(head, facts, heads)

    def _header(self, head: LvmHead) -> tuple[dict[str, list[str]], list[str]] | None:
        """Return the facts and the heads of the columns of the next segment; None at the end of the file."""
        rows = self.rows
        while END_MARK not in rows.held and rows.more():
            if len(rows.held.lstrip()) > _READ and END_MARK not in rows.held:
                break
        at = rows.held.find(END_MARK)
        if at < 0:
            if rows.held.strip():
                raise InputError(
                    "has rows without the header of a segment; write the file again with its segment headers"
                )
            return None
        while rows.held.count(b"\n", at) < 2 and rows.more():
            pass
        lines = rows.take(at).split(b"\n")
        rows.take(rows.held.find(b"\n") + 1)
        heads = rows.take(rows.held.find(b"\n") + 1 or len(rows.held))
        facts = header_facts([decoded(line) for line in lines], head.separator)
        return facts, [field.strip() for field in decoded(heads).split(head.separator)]

    def _of_segment(self, head: LvmHead, facts: dict[str, list[str]], heads: list[str]) -> Iterator[LvmSegment]:
        """Yield the parts of a segment."""
        rows, first, before, is_last = self.rows, None, 0, False
        most = self.length + SHORTEST_BLOCK
        while not is_last:
            end = _end_of_segment(rows.held)
            while end < 0 and rows.held.count(b"\n") < most and rows.more():
                end = _end_of_segment(rows.held)
            size = len(rows.held) if end < 0 else end
            is_last = rows.held.count(b"\n", 0, size) < most
            line = rows.line
            body = rows.take(size if is_last else rows.ends(self.length, size))
            if not body.strip():
                continue
            part = lvm_segment(head, _after(facts, before), heads, body, first=line)
            first = first or part
            yield _moved(part, first, before)
            before += sum(bool(row.strip()) for row in body.split(b"\n"))


def _end_of_segment(held: bytes) -> int:
    """Return where the header of the next segment begins; -1 if it is not there."""
    return 0 if held.startswith(b"Channels") else held.find(b"\nChannels") + 1 or -1


def _after(facts: dict[str, list[str]], rows: int) -> dict[str, list[str]]:
    """Return the facts of a segment whose first rows were read: fewer samples are left."""
    left = [str(max(int(text) - rows, 0)) if text.isdigit() else text for text in facts.get("samples", [])]
    return facts | {"samples": left}


def _moved(part: LvmSegment, first: LvmSegment, before: int) -> LvmSegment:
    """Return a part of a segment with its starts, ``before`` rows after those of the segment's first part."""
    starts = []
    for k, (start, step, times) in enumerate(zip(part.starts, part.steps, part.times, strict=True)):
        of_first = first.times[k]
        passed = before * step if np.isfinite(step) else 0.0
        if times is not None and of_first is not None and times.size:
            stored = float(times[0] - of_first[0])
            if np.isfinite(step) and abs(stored - passed) > _LEAP * step + 1e-6 * abs(float(times[0])):
                raise InputError(
                    f"channel {part.names[k]}: Delta_X states {step:.6g} s, and its times (X_Value) rise by "
                    f"{stored:.6g} s in {before} samples; write the file again"
                )
            passed = passed if np.isfinite(step) else stored
        starts.append(start + passed)
    return replace(part, starts=tuple(starts))
