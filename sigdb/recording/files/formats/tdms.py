"""TDMS files as LabVIEW, DIAdem and DAQmx write them: numeric channels with their scales, rates and start times."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from itertools import pairwise
from mmap import ACCESS_READ, mmap
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
from sigdb.recording.files.formats.named_arrays import not_read, rate_of
from sigdb.recording.files.formats.sample_window import WHOLE, SampleWindow, window_blocks
from sigdb.recording.files.formats.tdms_numbers import RawNumbers, kind_in_words, raw_numbers
from sigdb.recording.files.formats.tdms_scales import UnreadScaleError, has_scales, scaled
from sigdb.recording.files.formats.tdms_segments import Meta, Properties, TimeStamp, segments
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.files.time_columns import SAME
from sigdb.recording.files.time_names import seconds_of

FOREIGN: tuple[type[Exception], ...] = ()

TIME_WORDS = {"", "time", "zeit", "temps", "tiempo", "tempo", "tid", "tijd", "t", "x", "时间", "時間", "время"}
"""Names of an abscissa that is the time where its unit is not stated."""

NOT_TIME = ("freq", "order", "ordnung", "quefr", "lag", "angle", "winkel")
"""Beginnings of names of an abscissa that is not the time, even where its unit is one of time."""

UNITS = ("unit_string", "unit", "units", "engineering units", "engineering unit", "y_unit", "yunit")


@dataclass(frozen=True, kw_only=True)
class _Block:
    """Properties of time that a channel had when its samples from ``first`` on were written."""

    first: int
    start: TimeStamp | None
    offset: float
    interval: float | None


@dataclass
class _Pieces:
    """Raw numbers that follow each other, and the number after the last of each piece."""

    pieces: list[RawNumbers] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)

    @property
    def size(self) -> int:
        return self.ends[-1] if self.ends else 0

    def add(self, piece: RawNumbers) -> None:
        self.pieces.append(piece)
        self.ends.append(self.size + piece.size)

    def part(self, window: SampleWindow) -> StoredArray:
        """Return the numbers in a window."""
        wanted = window.of(self.size)
        parts = []
        for i in range(bisect_right(self.ends, wanted.start), len(self.pieces)):
            piece = self.pieces[i]
            begin = self.ends[i] - piece.size
            if begin >= wanted.stop:
                break
            parts.append(piece.part(max(wanted.start - begin, 0), min(wanted.stop - begin, piece.size)))
        return parts[0] if len(parts) == 1 else np.concatenate(parts or [self.pieces[0].part(0, 0)])


@dataclass
class _Series:
    """Raw numbers of a channel, by the scale that they belong to, and its blocks."""

    pieces: dict[int | None, _Pieces] = field(default_factory=dict)
    blocks: list[_Block] = field(default_factory=list)
    count: int = 0

    def add(self, properties: Properties) -> None:
        """Note the properties of time of the samples that follow, where they changed."""
        block = _block(properties, self.count)
        last = self.blocks[-1] if self.blocks else None
        if last is None or (last.start, last.offset, last.interval) != (block.start, block.offset, block.interval):
            self.blocks.append(block)

    def raw(self, window: SampleWindow) -> dict[int | None, StoredArray]:
        """Return the raw numbers of each scale in a window."""
        return {scale: pieces.part(window) for scale, pieces in self.pieces.items()}


FIRST_OF_1970 = 2_082_844_800
"""Beginning of 1970 in s after that of 1904."""


def read_tdms(path: Path, settings: RecordingSettings) -> Contents:
    """Read channels ``group/channel``, or ``channel`` where there is one group; ``variable`` is a group.

    The sampling rate is one over the property ``wf_increment``, or a property such as ``Sample Rate``; the start is
    ``wf_start_time`` and ``wf_start_offset``; the abscissa is ``wf_xname``; the unit is ``unit_string``.
    """
    channels = _channels(memoryview(bounded_bytes(path)))
    check_values(sum(pieces.size for each in channels.series.values() for pieces in each.pieces.values()))
    return _contents(channels, settings, WHOLE)


def tdms_blocks(path: Path, settings: RecordingSettings, samples: int | None) -> Iterator[Contents]:
    """Yield the channels of a TDMS file in blocks, whatever its segments.

    Parameters
    ----------
    path
        The file.
    settings
        Settings of reading; variable is a group.
    samples
        Samples of a block.
    """
    with path.open("rb") as file:
        channels = _channels(memoryview(mmap(file.fileno(), 0, access=ACCESS_READ)))
    return window_blocks(partial(_contents, channels, settings), samples)


@dataclass(frozen=True, kw_only=True)
class _Channels:
    """Series of all channels by path, kinds of the objects that hold no numbers, all properties, and notes."""

    series: dict[str, _Series]
    kinds: dict[str, int]
    meta: Meta
    notes: tuple[Note, ...]


def _contents(channels: _Channels, settings: RecordingSettings, window: SampleWindow) -> Contents:
    series, kinds, notes = channels.series, channels.kinds, [*channels.notes]
    check_columns(len(series))
    names = _channel_names(series, settings.variable)
    notes += _others_left_out(_channel_names(kinds, settings.variable), kinds, names)
    if not names:
        others = "".join(f"; {note.text}" for note in notes[:3])
        raise InputError(f"holds no numbers{f' in a group {settings.variable!r}' if settings.variable else ''}{others}")
    starts = [start for path_ in names if (start := _start_time(series[path_])) is not None]
    origin = min(starts, default=None)
    columns = []
    for path_, name in names.items():
        try:
            column, column_notes = _column(name, series[path_], _levels(channels.meta, path_), origin, settings, window)
        except UnreadScaleError as error:
            notes.append(Note(code="channel-left-out", text=f"{name} was left out: it has {error}"))
            continue
        columns.append(column)
        notes += column_notes
    if not columns:
        raise InputError(f"holds no channel that can be read: {'; '.join(note.text for note in notes[:3])}")
    zero_time = None if origin is None else origin.since(TimeStamp(seconds=FIRST_OF_1970, fraction=0))
    return Contents(columns=tuple(columns), notes=tuple(notes), zero_time=zero_time)


def _channels(data: memoryview) -> _Channels:
    """Return the raw numbers of all channels as views of the bytes of a file."""
    meta = Meta()
    series: dict[str, _Series] = {}
    kinds: dict[str, int] = {}
    torn: set[str] = set()
    for segment in segments(data, meta):
        pieces, rest = raw_numbers(segment)
        kinds.update({name: index.kind for name, index in segment.objects if not index.scalers})
        for piece in pieces:
            of_name = series.setdefault(piece.name, _Series())
            if piece.name in torn:
                raise InputError(f"is damaged: {piece.name} goes on after a part that is not whole")
            if piece.scale not in of_name.pieces or len(of_name.pieces) == 1:
                of_name.add(meta.properties.get(piece.name, {}))
                of_name.count += piece.size
            of_name.pieces.setdefault(piece.scale, _Pieces()).add(piece)
        if rest:
            torn.update(name for name, _ in segment.objects)
    for name, of_name in series.items():
        of_name.add(meta.properties.get(name, {}))
    note = Note(code="last-part-left-out", text="the last part is not whole and was left out")
    return _Channels(series=series, kinds=kinds, meta=meta, notes=(note,) if torn else ())


def _channel_names(paths: Iterable[str], group: str | None) -> dict[str, str]:
    """Return the channel's name for each path."""
    parts = {path: _parts(path) for path in paths}
    chosen = {path: names for path, names in parts.items() if group in (None, names[0], "/".join(names))}
    same_group = len({names[0] for names in chosen.values()}) == 1
    return {path: "/".join(names[1:] if same_group and len(names) > 1 else names) for path, names in chosen.items()}


def _parts(path: str) -> list[str]:
    return [part.replace("''", "'") for part in path.strip("/'").split("'/'")]


def _others_left_out(others: Mapping[str, str], kinds: Mapping[str, int], names: Mapping[str, str]) -> Iterator[Note]:
    """Yield a note on each object that holds other things than numbers."""
    return (not_read(name, f"{kind_in_words(kinds[path])}, so not a channel") for path, name in others.items()
            if path not in names)  # fmt: skip


def _levels(meta: Meta, path: str) -> tuple[Properties, ...]:
    """Return the properties of a channel, of its group and of the file."""
    group = path[: path.rfind("'/'") + 1]
    return tuple(meta.properties.get(level, {}) for level in (path, group, "/"))


def _block(properties: Properties, first: int) -> _Block:
    start = properties.get("wf_start_time")
    start = _of_text(start) if isinstance(start, str) else start
    is_stated = isinstance(start, TimeStamp) and start != TimeStamp(seconds=0, fraction=0)
    unit = seconds_of(str(properties.get("wf_xunit_string", ""))) or 1.0
    interval = _finite(properties.get("wf_increment"))
    return _Block(
        first=first,
        start=start if is_stated and isinstance(start, TimeStamp) else None,
        offset=(_finite(properties.get("wf_start_offset")) or 0.0) * unit,
        interval=interval * unit if interval is not None and interval > 0 else None,
    )


def _of_text(date: str) -> TimeStamp | None:
    """Return a date and time as ISO 8601 writes it, without a time zone in UTC; None for other texts."""
    try:
        moment = datetime.fromisoformat(date.strip())
    except ValueError:
        return None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    passed = moment - datetime(1904, 1, 1, tzinfo=UTC)
    return TimeStamp(seconds=passed.days * 86_400 + passed.seconds, fraction=passed.microseconds * 2**64 // 10**6)


def _finite(value: object) -> float | None:
    return float(value) if isinstance(value, (int, float)) and np.isfinite(value) else None


def _start_time(series: _Series) -> TimeStamp | None:
    return _first_block(series).start


def _first_block(series: _Series) -> _Block:
    """Return the properties of time that hold from the first sample on.

    They may be written after the samples; those written for later samples come after the first ones.
    """
    first = [block for block in series.blocks if block.first == 0]
    after = [block for block in series.blocks if block.first == series.count]
    return after[-1] if len(first) + len(after) == len(series.blocks) and after else first[-1]


def _column(
    name: str,
    series: _Series,
    levels: tuple[Properties, ...],
    origin: TimeStamp | None,
    settings: RecordingSettings,
    window: SampleWindow,
) -> tuple[DataColumn, list[Note]]:
    properties = levels[0]
    values = scaled(series.raw(window), levels)
    unit = next((str(value) for key, value in properties.items() if key.lower() in UNITS and value), "")
    if values.dtype.names:
        first = next(iter(series.raw(SampleWindow(0, 1)).values()))[:1]
        return DataColumn(name=name, values=_seconds(values, first), unit="s"), []
    notes = []
    if None not in series.pieces and not has_scales(levels):
        text = f"{name} holds raw numbers of the converter, without a scale to {unit or 'a unit'}"
        notes.append(Note(code="raw-numbers", text=text, values={"channel": name}))
        unit = ""
    start_time = properties.get("wf_start_time")
    if isinstance(start_time, str) and start_time.strip() and _of_text(start_time) is None:
        text = f"{name} has the start {start_time[:40]!r} as text, which is no date of ISO 8601 and was not read"
        notes.append(Note(code="start-not-read", text=text, values={"channel": name}))
    block = _first_block(series)
    rate, source, rate_notes = _rate(name, block.interval, levels)
    abscissa = _abscissa(properties)
    if abscissa == "time" and settings.sampling_rate is None:
        _refuse_breaks(name, series)
    start = None if origin is None or block.start is None else block.start.since(origin) + block.offset
    if origin is None and "wf_start_offset" in properties:
        start = block.offset
    column = DataColumn(
        name=name, values=values, unit=unit, sampling_rate=rate, rate_from=source,
        start=start if abscissa == "time" else None, abscissa=abscissa,
    )  # fmt: skip
    return column, notes + rate_notes


def _seconds(stamps: StoredArray, first: StoredArray) -> StoredArray:
    """Return time stamps in s since the first one."""
    seconds = (stamps["seconds"] - first["seconds"]).astype(float)
    return seconds + stamps["fraction"].astype(float) / 2**64 - first["fraction"].astype(float) / 2**64


def _abscissa(properties: Properties) -> str:
    """Return "time", or the name and the unit of another quantity along the samples."""
    name = str(properties.get("wf_xname", "")).strip()
    unit = str(properties.get("wf_xunit_string", "")).strip()
    of_unit = seconds_of(unit) is not None and not name.lower().startswith(NOT_TIME)
    is_time = of_unit if unit else name.lower() in TIME_WORDS
    return "time" if is_time else f"{name or 'a quantity'}{f' in {unit}' if unit else ''}"


def _rate(name: str, interval: float | None, levels: tuple[Properties, ...]) -> tuple[float | None, str, list[Note]]:
    """Return the rate in Hz, the entry that states it, and notes on other rates; an interval of 1 is the default."""
    owners = (f"of {name}", "of its group", "of the file")
    stated = next(
        (
            (rate, f"property {key!r} {owner}")
            for level, owner in zip(levels, owners, strict=True)
            for key, value in level.items()
            if not isinstance(value, TimeStamp)
            and not key.startswith("wf_")
            and (rate := rate_of(key, value)) is not None
        ),
        None,
    )
    if interval is None:
        return (*stated, []) if stated else (None, "the file", [])
    increment = (1 / interval, f"wf_increment of {name}")
    if stated is None or abs(stated[0] - increment[0]) <= SAME * stated[0]:
        return (*increment, [])
    taken, other = (stated, increment) if interval == 1 else (increment, stated)
    text = f"{other[1]} states {other[0]:.9g} Hz; {taken[0]:.9g} Hz by {taken[1]} was taken"
    return (*taken, [Note(code="ignored-sampling-rate", text=text, values={"sampling_rate": other[0]})])


def _refuse_breaks(name: str, series: _Series) -> None:
    """Refuse samples that do not go on where the samples before them end."""
    blocks = [block for block in series.blocks if block.first < series.count]
    for before, block in pairwise(blocks):
        if before.interval != block.interval:
            raise InputError(
                f"channel {name} changes its sampling interval from {before.interval} s to {block.interval} s at "
                f"sample {block.first}; cut it in two, or give sampling_rate"
            )
        if before.start is None or block.start is None or block.interval is None:
            continue
        passed = block.start.since(before.start) + block.offset - before.offset
        late = passed / block.interval - (block.first - before.first)
        if abs(late) > 0.5:
            raise InputError(
                f"the part of channel {name} from sample {block.first} on starts {abs(late):.3g} samples "
                f"{'late' if late > 0 else 'early'} by wf_start_time; cut it there, or give sampling_rate to join "
                "the parts"
            )
