"""Several recordings joined to one: parts that follow each other, or channels that were measured at once."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import blake2b

import numpy as np

from sigdb.core import InputError, Note
from sigdb.recording.files.formats.contents import check_columns, check_values
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.recording import Channel, Recording

TOLERANCE = 0.5
"""Distance from the end of a part, in samples, at which the next part begins in time."""

CUTS = ("cut-to-common-part", "cut-to-shared-time")
"""Codes of notes on samples that were cut off at the ends of a recording."""


@dataclass(frozen=True, kw_only=True)
class RecordingPart:
    """The recording in a file, and the name of the file without its suffix."""

    name: str
    recording: Recording


def join(parts: Sequence[RecordingPart], settings: RecordingSettings, *, source: str) -> Recording:
    """Return the recording that some files hold together.

    Parameters
    ----------
    parts
        Recordings in the order of their names.
    settings
        ``parts`` is ``contiguous`` if each follows the one before without a gap, ``channels`` if they were measured at
        once, None to decide it by the times in the files.
    source
        Name of the folder or archive.

    Raises
    ------
    InputError
        If the parts have different channels, rates or units, leave gaps, or do not state whether they do.
    """
    if len(parts) == 1:
        return replace(parts[0].recording, source=source)
    if any(part.recording.pulse_times is not None for part in parts):
        raise InputError("holds files with times of pulses, which are not joined; read them one by one")
    as_channels = settings.parts == "channels" or (settings.parts is None and _are_channels(parts))
    return _side_by_side(parts, source, settings) if as_channels else _end_to_end(parts, source, settings)


def _are_channels(parts: Sequence[RecordingPart]) -> bool:
    """Return whether files of one channel each have names that are no numbers of parts, or all begin at one time."""
    if any(len(part.recording.channels) > 1 for part in parts):
        return False
    names = [part.recording.channels[0].name for part in parts]
    if len(set(names)) == len(names):
        return True
    return len({re.sub(r"\d+", "", part.name) for part in parts}) == len(parts)


def _side_by_side(parts: Sequence[RecordingPart], source: str, settings: RecordingSettings) -> Recording:
    """Return one recording with the channels of all parts, which begin and end together."""
    several = [part.name for part in parts if len(part.recording.channels) > 1]
    if several:
        raise InputError(f"{several[0]} holds several channels; parts = 'channels' joins files of one channel each")
    channels = [part.recording.channels[0] for part in parts]
    by_channel = [channel.name for channel in channels]
    names = by_channel if len(set(by_channel)) == len(by_channel) else [part.name for part in parts]
    if len(set(names)) < len(names):
        raise InputError("holds two files of one name in different folders; give them different names")
    check_columns(len(channels))
    first = channels[0]
    for part, channel in zip(parts, channels, strict=True):
        if channel.samples.size != first.samples.size or not _same_rate(channel, first):
            raise InputError(
                f"the files do not cover the same time: {parts[0].name} holds {first.samples.size} samples at "
                f"{first.sampling_rate:.9g} Hz, {part.name} {channel.samples.size} at {channel.sampling_rate:.9g} Hz; "
                "if they follow each other, give parts = 'contiguous'"
            )
    starts = [_begin(part.recording, 0) for part in parts]
    if np.ptp(starts) * first.sampling_rate > TOLERANCE:
        late = int(np.argmax(starts))
        raise InputError(
            f"{parts[late].name} begins {max(starts) - min(starts):.6g} s after the first file; channels measured at "
            "once begin together"
        )
    renamed = tuple(
        replace(channel, name=name, sampling_rate=first.sampling_rate)
        for channel, name in zip(channels, names, strict=True)
    )
    text = f"{_listed(parts)}: {len(parts)} files were read as channels measured at once; it is for you to know"
    note = Note(code="files-as-channels", text=text, values={"files": len(parts)})
    return replace(
        parts[0].recording, source=source, channels=renamed, notes=(note, *_notes(parts)), tacho=settings.tacho
    )


def _end_to_end(parts: Sequence[RecordingPart], source: str, settings: RecordingSettings) -> Recording:
    first = parts[0].recording
    for part in parts[1:]:
        _check_same(parts[0], part)
    stated = _check_times(parts, settings)
    _refuse_copies(parts)
    check_values(sum(channel.samples.size for part in parts for channel in part.recording.channels))
    channels = tuple(
        replace(channel, samples=np.concatenate([part.recording.channels[i].samples for part in parts]))
        for i, channel in enumerate(first.channels)
    )
    how = "by their times" if stated else "because parts = 'contiguous' says that they follow each other"
    text = f"{_listed(parts)}: {len(parts)} files were joined end to end, {how}"
    note = Note(code="files-joined", text=text, values={"files": len(parts)})
    return replace(first, source=source, channels=channels, notes=(note, *_notes(parts)))


def _refuse_copies(parts: Sequence[RecordingPart]) -> None:
    """Refuse two parts with the same samples, unless they are constant."""
    seen: dict[bytes, str] = {}
    for part in parts:
        samples = [channel.samples for channel in part.recording.channels]
        if all(x.min() == x.max() for x in samples):
            continue
        other = seen.setdefault(blake2b(b"".join(x.tobytes() for x in samples)).digest(), part.name)
        if other != part.name:
            raise InputError(f"{part.name} holds the same samples as {other}; leave out the copy")


def _check_same(first: RecordingPart, part: RecordingPart) -> None:
    ours, theirs = first.recording.channels, part.recording.channels
    if [channel.name for channel in ours] != [channel.name for channel in theirs]:
        raise InputError(
            f"{part.name} holds the channels {', '.join(channel.name for channel in theirs[:8])}, {first.name} "
            f"{', '.join(channel.name for channel in ours[:8])}; give channels, or read the files one by one"
        )
    for channel, other in zip(ours, theirs, strict=True):
        if not _same_rate(other, channel):
            raise InputError(
                f"channel {channel.name} has {channel.sampling_rate:.9g} Hz in {first.name} and "
                f"{other.sampling_rate:.9g} Hz in {part.name}; read the files one by one, or give sampling_rate if one "
                "of these rates is wrong"
            )
        if channel.unit != other.unit:
            raise InputError(
                f"channel {channel.name} is in {channel.unit!r} in {first.name} and in {other.unit!r} in "
                f"{part.name}; read the files one by one, or give units if one of these is wrong"
            )


def _check_times(parts: Sequence[RecordingPart], settings: RecordingSettings) -> bool:
    """Return whether the files state times, which follow each other; False where they state none."""
    for i in range(len(parts[0].recording.channels)):
        rate = parts[0].recording.channels[i].sampling_rate
        begins = [_begin(part.recording, i) for part in parts]
        sizes = [part.recording.channels[i].samples.size for part in parts]
        if np.ptp(begins) * rate <= TOLERANCE:
            _check_word(parts, settings)
            return False
        gaps = [
            (begin - last) * rate - size
            for last, begin, size in zip(begins[:-1], begins[1:], sizes[:-1], strict=True)
        ]  # fmt: skip
        wrong = [j for j, gap in enumerate(gaps) if abs(gap) > TOLERANCE]
        if wrong:
            raise _gap_error(parts, wrong, gaps, rate)
    return True


def _gap_error(parts: Sequence[RecordingPart], wrong: list[int], gaps: list[float], rate: float) -> InputError:
    gaps_in_words = [
        f"{parts[j + 1].name} begins {abs(gaps[j]) / rate:.6g} s ({abs(gaps[j]):.6g} samples) "
        f"{'after' if gaps[j] > 0 else 'before'} the end of {parts[j].name}"
        for j in wrong[:3]
    ]
    more = f", and {len(wrong) - 3} more" if len(wrong) > 3 else ""
    return InputError(f"the files do not follow each other: {'; '.join(gaps_in_words)}{more}; read them one by one")


def _check_word(parts: Sequence[RecordingPart], settings: RecordingSettings) -> None:
    """Refuse files without times, unless the user says that they follow each other and no end was cut off."""
    if settings.parts != "contiguous":
        once = all(len(part.recording.channels) == 1 for part in parts)
        other = ", or parts = 'channels' if they were measured at once" if once else ""
        raise InputError(
            f"holds {len(parts)} files ({_listed(parts)}) that do not state at what time each begins; give parts = "
            f"'contiguous' if each follows the one before without a gap{other}, or read them one by one"
        )
    for part in parts:
        if any(note.code in CUTS for note in part.recording.notes):
            raise InputError(f"{part.name} lacks samples at an end, so the next file does not follow it")


def _begin(recording: Recording, channel: int) -> float:
    """Return the time of the first sample, s; after 1970 where the file states a date."""
    return (recording.zero_time or 0.0) + recording.channels[channel].start


def _same_rate(channel: Channel, other: Channel) -> bool:
    """Return whether two rates differ by less than half a sample over the length of a channel."""
    return abs(channel.sampling_rate / other.sampling_rate - 1) * channel.samples.size < TOLERANCE


def _notes(parts: Sequence[RecordingPart]) -> list[Note]:
    """Return the notes of all parts; those that not all have begin with the name of the file."""
    everywhere = set.intersection(*({note.text for note in part.recording.notes} for part in parts))
    notes = [note for note in parts[0].recording.notes if note.text in everywhere]
    notes += [
        replace(note, text=f"{part.name}: {note.text}")
        for part in parts
        for note in part.recording.notes
        if note.text not in everywhere
    ]
    return notes


def _listed(parts: Sequence[RecordingPart]) -> str:
    names = [part.name for part in parts]
    return ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:2])} ... {names[-1]}"
