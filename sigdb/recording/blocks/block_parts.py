"""Consecutive parts of a file that is read in blocks, each assembled as a recording."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sigdb.core import InputError
from sigdb.recording.files.assemble import assemble, named_columns
from sigdb.recording.files.formats.contents import Contents, DataColumn
from sigdb.recording.files.kinds import FileKind
from sigdb.recording.files.read import foreign_errors, with_format
from sigdb.recording.files.sampling_rates import without_slow
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.recording import Recording


@dataclass(frozen=True, kw_only=True)
class BlockPart:
    """A part of a file.

    Attributes
    ----------
    contents
        Its columns.
    recording
        The recording that they describe.
    first, size
        Number of its first sample in the file, and of its samples there.
    """

    contents: Contents
    recording: Recording
    first: int
    size: int


def block_parts(
    path: Path, kind: FileKind, settings: RecordingSettings, *, samples: int | None, seek_faults: bool = False
) -> Iterator[BlockPart]:
    """Yield the consecutive parts of a file.

    Parameters
    ----------
    path, kind
        The file and its format.
    settings
        Settings of reading that name all channels and the column of times, since no part decides on them.
    samples
        Samples of a part.
    seek_faults
        Whether faults of samples are noted.

    Raises
    ------
    InputError
        If a part is no recording, or samples are missing at an inner edge of it.
    """
    first = 0
    for contents, size, is_last in contents_blocks(path, kind, settings, samples=samples):
        try:
            recording = assemble(contents, settings, source=str(path), seek_ramps=False, seek_faults=seek_faults)
            _refuse_cut(recording, size, is_first=first == 0, is_last=is_last)
        except InputError as error:
            where = f"in the block of samples {first} to {first + size}, counted from its first: " if first else ""
            raise InputError(f"{where}{error}") from None
        yield BlockPart(contents=contents, recording=recording, first=first, size=size)
        first += size


def contents_blocks(
    path: Path, kind: FileKind, settings: RecordingSettings, *, samples: int | None
) -> Iterator[tuple[Contents, int, bool]]:
    """Yield the columns of consecutive blocks, their number of samples, and whether a block is the last.

    Parameters
    ----------
    path, kind
        The file and its format, which reads in blocks.
    settings
        Settings of reading.
    samples
        Samples of a block.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, or holds channels of different lengths.
    """
    assert kind.blocks is not None
    before: tuple[Contents, int] | None = None
    with foreign_errors(kind):
        for contents in kind.blocks(path, settings, samples):
            size = _size(contents, settings)
            if before is not None and not size:
                break
            if before is not None:
                yield *before, False
            before = with_format(contents, kind, path, settings), size
    if before is None or not before[1]:
        raise InputError("holds no samples")
    yield *before, True


def _size(contents: Contents, settings: RecordingSettings) -> int:
    """Return the number of samples in the channels that the settings choose, which must be the same."""
    sizes = {column.name: column.values.size for column in used_columns(contents, settings)}
    if len(set(sizes.values())) > 1:
        shortest, longest = min(sizes, key=sizes.__getitem__), max(sizes, key=sizes.__getitem__)
        raise InputError(
            f"holds columns of different lengths, such as {shortest} and {longest}, which are not read in blocks; "
            "choose those of one length by channels"
        )
    return next(iter(sizes.values()), contents.columns[0].values.size)


def of_channels(settings: RecordingSettings, names: tuple[str, ...], tacho: str | None) -> RecordingSettings:
    """Return the settings for some of the channels."""
    stated = {*names, settings.time}
    by_channel = {
        key: {name: value for name, value in table.items() if name in stated}
        for key, table in (("units", settings.units), ("scale", settings.scale))
        if isinstance(table, dict)
    }
    return settings.model_copy(update={"channels": names, "tacho": tacho, **by_channel})


def used_columns(contents: Contents, settings: RecordingSettings) -> tuple[DataColumn, ...]:
    """Return the columns of samples that the settings choose, with the times; else all that are not too slow."""
    pulses = settings.tacho if settings.tacho_kind == "pulse-times" else None
    columns = tuple(column for column in named_columns(contents, settings)[0] if column.name != pulses)
    if settings.channels is not None:
        wanted = {*settings.channels, settings.tacho, settings.time}
        return tuple(column for column in columns if column.name in wanted)
    return without_slow(columns, (settings.tacho,))[0] if settings.sampling_rate is None else columns


def _refuse_cut(recording: Recording, size: int, *, is_first: bool, is_last: bool) -> None:
    """Refuse samples that are missing at an edge of a block and were cut; those at the ends of the file may be."""
    if all(channel.samples.size == size for channel in recording.channels):
        return
    for note in recording.notes:
        begin, end = note.values.get("first"), note.values.get("end")
        if note.code != "cut-to-common-part" or not isinstance(begin, int) or not isinstance(end, int):
            continue
        if (begin and not is_first) or (end < size and not is_last):
            at = 0 if begin and not is_first else end
            raise InputError(
                f"samples are missing at its edge, from sample {at} on, where no straight line fills them; fill them, "
                "or choose another number of samples of a block"
            )
        return
    raise InputError("its channels do not cover the same time; choose channels that do")
