"""TDMS files as LabVIEW, DIAdem and DAQmx write them: numeric channels with their scales, rates and start times."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
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
from sigdb.recording.files.formats.tdms_numbers import kind_in_words, raw_numbers
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
class _Series:
    """Pieces of the raw numbers of a channel, by the scale that they belong to, and its blocks."""

    pieces: dict[int | None, list[StoredArray]] = field(default_factory=dict)
    blocks: list[_Block] = field(default_factory=list)
    count: int = 0

    def add(self, properties: Properties) -> None:
        """Note the properties of time of the samples that follow, where they changed."""
        block = _block(properties, self.count)
        last = self.blocks[-1] if self.blocks else None
        if last is None or (last.start, last.offset, last.interval) != (block.start, block.offset, block.interval):
            self.blocks.append(block)

    def raw(self) -> dict[int | None, StoredArray]:
        return {
            scale: pieces[0] if len(pieces) == 1 else np.concatenate(pieces) for scale, pieces in self.pieces.items()
        }


FIRST_OF_1970 = 2_082_844_800
"""Beginning of 1970 in s after that of 1904."""


def read_tdms(path: Path, settings: RecordingSettings) -> Contents:
    """Read channels ``group/channel``, or ``channel`` where there is one group; ``variable`` is a group.

    The sampling rate is one over the property ``wf_increment``, or a property such as ``Sample Rate``; the start is
    ``wf_start_time`` and ``wf_start_offset``; the abscissa is ``wf_xname``; the unit is ``unit_string``.
    """
    meta = Meta()
    series, kinds, notes = _series(memoryview(bounded_bytes(path)), meta)
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
            column, column_notes = _column(name, series[path_], _levels(meta, path_), origin, settings)
        except UnreadScaleError as error:
            notes.append(Note(code="channel-left-out", text=f"{name} was left out: it has {error}"))
            continue
        columns.append(column)
        notes += column_notes
    if not columns:
        raise InputError(f"holds no channel that can be read: {'; '.join(note.text for note in notes[:3])}")
    zero_time = None if origin is None else origin.since(TimeStamp(seconds=FIRST_OF_1970, fraction=0))
    return Contents(columns=tuple(columns), notes=tuple(notes), zero_time=zero_time)


def _series(data: memoryview, meta: Meta) -> tuple[dict[str, _Series], dict[str, int], list[Note]]:
    """Return the raw numbers of all channels, the kinds of the objects that hold other things, and notes."""
    series: dict[str, _Series] = {}
    kinds: dict[str, int] = {}
    torn: set[str] = set()
    total = 0
    for segment in segments(data, meta):
        pieces, rest = raw_numbers(segment)
        kinds.update({name: index.kind for name, index in segment.objects if not index.scalers})
        for piece in pieces:
            of_name = series.setdefault(piece.name, _Series())
            if piece.name in torn:
                raise InputError(f"is damaged: {piece.name} goes on after a part that is not whole")
            if piece.scale not in of_name.pieces or len(of_name.pieces) == 1:
                of_name.add(meta.properties.get(piece.name, {}))
                of_name.count += piece.values.size
            of_name.pieces.setdefault(piece.scale, []).append(piece.values)
            total += piece.values.size
            check_values(total)
        if rest:
            torn.update(name for name, _ in segment.objects)
    for name, of_name in series.items():
        of_name.add(meta.properties.get(name, {}))
    note = Note(code="last-part-left-out", text="the last part is not whole and was left out")
    return series, kinds, [note] if torn else []


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
    is_stated = isinstance(start, TimeStamp) and start != TimeStamp(seconds=0, fraction=0)
    unit = seconds_of(str(properties.get("wf_xunit_string", ""))) or 1.0
    interval = _finite(properties.get("wf_increment"))
    return _Block(
        first=first,
        start=start if is_stated and isinstance(start, TimeStamp) else None,
        offset=(_finite(properties.get("wf_start_offset")) or 0.0) * unit,
        interval=interval * unit if interval is not None and interval > 0 else None,
    )


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
    name: str, series: _Series, levels: tuple[Properties, ...], origin: TimeStamp | None, settings: RecordingSettings
) -> tuple[DataColumn, list[Note]]:
    properties = levels[0]
    values = scaled(series.raw(), levels)
    unit = next((str(value) for key, value in properties.items() if key.lower() in UNITS and value), "")
    if values.dtype.names:
        return DataColumn(name=name, values=_seconds(values), unit="s"), []
    notes = []
    if None not in series.pieces and not has_scales(levels):
        text = f"{name} holds raw numbers of the converter, without a scale to {unit or 'a unit'}"
        notes.append(Note(code="raw-numbers", text=text, values={"channel": name}))
        unit = ""
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


def _seconds(stamps: StoredArray) -> StoredArray:
    """Return time stamps in s since the first one."""
    if not stamps.size:
        return np.zeros(0)
    seconds = (stamps["seconds"] - stamps["seconds"][0]).astype(float)
    return seconds + stamps["fraction"].astype(float) / 2**64 - float(stamps["fraction"][0]) / 2**64


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
