"""Survey of a file in blocks: which channels and times it has, and the facts about the whole recording."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sigdb.core import FloatArray, InputError, Note
from sigdb.recording.blocks.block_parts import BlockPart, block_parts, contents_blocks, of_channels, used_columns
from sigdb.recording.blocks.block_times import BlockTime, BlockTimes
from sigdb.recording.files.assemble import assemble, named_columns, pulse_times_of
from sigdb.recording.files.formats.contents import Contents, DataColumn, check_values
from sigdb.recording.files.kinds import FileKind
from sigdb.recording.files.read import foreign_errors
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.files.time_columns import TimeColumn, time_columns
from sigdb.recording.recording import Channel, Recording, UnreadChannel

OF_SAMPLES = {"filled-gaps", "clipped", "spikes", "drop-outs", "constant-channel", "same-channel", "cut-to-common-part"}
"""Codes of notes on the samples of a block."""

_SEVERAL = "holds channels of different rates or starts, which are not read in blocks; choose by channels"


def surveyed(
    path: Path, kind: FileKind, settings: RecordingSettings, *, samples: int | None
) -> tuple[RecordingSettings, Recording]:
    """Return settings that name the channels and the time, and the whole recording without samples.

    Parameters
    ----------
    path, kind
        The file and its format.
    settings
        Settings of reading.
    samples
        Samples of a block.

    Raises
    ------
    InputError
        If a block is no recording, or does not go on from the one before.
    """
    contents = next(contents_blocks(path, kind, settings, samples=samples))[0]
    _refuse_several_rates(contents, settings)
    begin = assemble(contents, settings, source=str(path))
    times = _times(contents, settings)
    if len(times) > 1:
        names = ", ".join(time.name for time in times)
        raise InputError(f"holds several columns of times, {names}; give time={times[0].name!r} or another")
    if len({(channel.sampling_rate, channel.start) for channel in begin.channels}) > 1:
        raise InputError(_SEVERAL)
    begin_start = used_columns(contents, settings)[0].start
    chosen = tuple(channel.name for channel in begin.channels)
    pulses = None
    if begin.pulse_times is not None:
        origin = (begin.zero_time or 0.0) if begin.zero_time != contents.zero_time else 0.0
        pulses = _pulse_times(path, kind, settings, origin=origin, samples=samples)
    settings = settings.model_copy(update={"time": times[0].name if times else False})
    settings = of_channels(settings, chosen, settings.tacho if pulses is None else None)
    survey = _Survey({name: _Extent() for name in chosen}, {note.code for note in begin.notes})
    for part in block_parts(path, kind, settings, samples=samples, seek_faults=True):
        survey.take(part, _block_time(part, settings))
    rate = survey.times.slope_rate()
    has_times = times or (begin_start is not None and not contents.starts_of_file)
    if settings.sampling_rate is not None or not has_times:
        rate = begin.channels[0].sampling_rate
    channels = tuple(survey.extents[channel.name].channel(channel, rate) for channel in begin.channels)
    notes = (*_notes_on_file(begin.notes, rate), *survey.notes(channels), _blocks_note(survey))
    return settings, replace(begin, channels=channels, pulse_times=pulses, notes=notes)


def _pulse_times(
    path: Path, kind: FileKind, settings: RecordingSettings, *, origin: float, samples: int | None
) -> FloatArray:
    """Return the pulse times of all blocks, s; those that are missing at their end are padding."""
    assert kind.blocks is not None
    pulses: list[FloatArray] = []
    column: DataColumn | None = None
    padded = False
    with foreign_errors(kind):
        for contents in kind.blocks(path, settings, samples):
            column = next(each for each in named_columns(contents, settings)[0] if each.name == settings.tacho)
            stored = column.numbers.reshape(-1)
            present = np.flatnonzero(np.isfinite(stored))
            if present.size:
                pulses += [np.array([np.nan])] if padded else []
                pulses.append(stored[: present[-1] + 1].copy())
                check_values(sum(part.size for part in pulses))
            padded |= present.size == 0 or present[-1] + 1 < stored.size
    assert column is not None
    return pulse_times_of(replace(column, values=np.concatenate(pulses)), origin, settings)


def _refuse_several_rates(contents: Contents, settings: RecordingSettings) -> None:
    """Refuse different rates that a file states, before blocks of equal lengths seem to cover different times."""
    rates = {column.sampling_rate for column in used_columns(contents, settings)} - {None}
    if len(rates) > 1 and settings.sampling_rate is None:
        raise InputError(_SEVERAL)


def _times(contents: Contents, settings: RecordingSettings) -> tuple[TimeColumn, ...]:
    """Return the columns of times of a block."""
    columns = [column for column in named_columns(contents, settings)[0] if column.abscissa == "time"]
    return time_columns(columns, settings, named=contents.named or bool(settings.names))[0]


def _block_time(part: BlockPart, settings: RecordingSettings) -> BlockTime:
    """Return the times of a block: a column's, or the start that the file states."""
    times = _times(part.contents, settings)
    name = part.recording.channels[0].name
    column = next(column for column in named_columns(part.contents, settings)[0] if column.name == name)
    start, rate = column.start, part.recording.channels[0].sampling_rate
    if times and (start is None or part.contents.starts_of_file):
        start = times[0].base.start
    elif start is not None and part.contents.starts_of_file:
        start += part.first / rate
    return BlockTime(
        first=part.first,
        size=part.size,
        start=start,
        sampling_rate=times[0].base.sampling_rate if times else rate,
        resolution=times[0].base.resolution if times else 0.0,
    )


@dataclass
class _Extent:
    """Extent of a channel over its blocks: samples, extremes, and the sum of squares."""

    size: int = 0
    least: float = np.inf
    greatest: float = -np.inf
    squares: float = 0.0

    def take(self, channel: Channel) -> None:
        x = channel.samples
        self.size += x.size
        self.least, self.greatest = min(self.least, float(x.min())), max(self.greatest, float(x.max()))
        with np.errstate(over="ignore"):
            self.squares += float(np.dot(x, x))

    def channel(self, begin: Channel, rate: float) -> UnreadChannel:
        """Return the channel that begins with a block's channel."""
        return UnreadChannel(
            name=begin.name, samples=np.broadcast_to(np.float64(np.nan), (self.size,)), sampling_rate=rate,
            unit=begin.unit, rate_from=begin.rate_from, start=begin.start, least=self.least, greatest=self.greatest,
            rms=float(np.sqrt(self.squares / self.size)),
        )  # fmt: skip


@dataclass
class _Survey:
    """Facts about the blocks read so far."""

    extents: dict[str, _Extent]
    first_codes: set[str]
    times: BlockTimes = field(default_factory=BlockTimes)
    blocks: int = 0
    of_samples: dict[tuple[str, str], list[tuple[Note, BlockPart]]] = field(default_factory=dict)
    later: dict[str, Note] = field(default_factory=dict)

    def take(self, part: BlockPart, time: BlockTime) -> None:
        """Take the next block."""
        self.times.take(time)
        self.blocks += 1
        for channel in part.recording.channels:
            self.extents[channel.name].take(channel)
        place = replace(part, contents=Contents(columns=()), recording=_without_samples(part.recording))
        for note in part.recording.notes:
            if note.code in OF_SAMPLES:
                self.of_samples.setdefault((note.code, str(note.values.get("channel", ""))), []).append((note, place))
            elif note.code not in self.first_codes:
                self.later.setdefault(note.code, note)

    def notes(self, channels: Iterable[UnreadChannel]) -> list[Note]:
        """Return the notes on samples, one for each kind and channel, and others that the first block has not."""
        constant = {channel.name for channel in channels if channel.least == channel.greatest}
        notes = list(self.later.values())
        for (code, name), of_kind in self.of_samples.items():
            note, part = of_kind[0]
            if (code == "constant-channel" and name not in constant) or (
                code == "same-channel" and len(of_kind) < self.blocks
            ):
                continue
            if self.blocks > 1 and code not in ("constant-channel", "same-channel"):
                of = f"the first of {len(of_kind)} such blocks, samples {part.first} to {part.first + part.size}"
                note = replace(note, text=f"{note.text} ({of})", values={**note.values, "blocks": len(of_kind)})
            notes.append(note)
        return notes


def _without_samples(recording: Recording) -> Recording:
    """Return a recording of a sample a channel, which takes no memory."""
    channels = tuple(replace(channel, samples=channel.samples[:1].copy()) for channel in recording.channels)
    return replace(recording, channels=channels)


def _notes_on_file(notes: Iterable[Note], rate: float) -> list[Note]:
    """Return the notes of the first block on the file, with the rate of all blocks."""
    kept = []
    for note in notes:
        if note.code == "sampling-rate":
            text = f"sampling rate {rate:.9g} Hz from {note.values['source']}"
            kept.append(replace(note, text=text, values={**note.values, "sampling_rate": rate}))
        elif note.code not in OF_SAMPLES:
            kept.append(note)
    return kept


def _blocks_note(survey: _Survey) -> Note:
    return Note(code="read-in-blocks", text=f"read in blocks: {survey.blocks}", values={"blocks": survey.blocks})
