"""A recording that is read in blocks: its facts without samples, and consecutive parts of it."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Unpack

import numpy as np
import pandas as pd

from sigdb.core import InputError
from sigdb.recording.blocks.block_parts import BlockPart, block_parts, of_channels
from sigdb.recording.blocks.block_survey import surveyed
from sigdb.recording.files.formats.contents import MAX_VALUES, SHORTEST_BLOCK, TooLargeError
from sigdb.recording.files.kinds import KINDS, FileKind, file_kind
from sigdb.recording.files.parts.members import is_archive
from sigdb.recording.files.read import one_line_refusals, read_recording, recording_settings, refusals_of
from sigdb.recording.files.settings import RecordingOptions, RecordingSettings
from sigdb.recording.recording import Channel, Recording, UnreadChannel


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordingBlocks:
    """A recording that is read in blocks, so that no more than a block of it is in memory.

    Iteration yields consecutive :class:`Recording` objects with the same channels; it reads the file again each time.

    Attributes
    ----------
    whole
        The whole recording: its channels have the number of samples, rate, unit and start, but no samples.
    path
        The file.
    settings
        Settings of reading.
    samples
        Samples of a block, about; None for blocks of about 4 million numbers.

    Examples
    --------
    >>> import numpy as np
    >>> np.save("run.npy", np.sin(np.arange(50_000) / 10))
    >>> recording = read_in_blocks("run.npy", samples=20_000, sampling_rate=10_000)
    >>> [part.channels[0].samples.size for part in recording]
    [20000, 20000, 10000]
    >>> recording.whole.channels[0].duration
    5.0
    """

    whole: Recording
    path: Path
    settings: RecordingSettings
    samples: int | None

    @property
    def source(self) -> str:
        """The file."""
        return self.whole.source

    @property
    def torque(self) -> float | None:
        """Torque on the shaft of interest, N m, where stated."""
        return self.whole.torque

    @property
    def load(self) -> float | None:
        """Load of the machine, where stated."""
        return self.whole.load

    @property
    def channels(self) -> tuple[UnreadChannel, ...]:
        """Channels without samples."""
        return tuple(channel for channel in self.whole.channels if isinstance(channel, UnreadChannel))

    def __iter__(self) -> Iterator[Recording]:
        """Yield the consecutive parts of the recording with all of its channels."""
        return self.parts()

    def parts(self, *names: str) -> Iterator[Recording]:
        """Yield the consecutive parts of the recording.

        Parameters
        ----------
        *names : str
            Channels of the parts; all if left out.

        Yields
        ------
        Recording
            Its channels have the rate of the whole recording, and start where the part before ends.

        Raises
        ------
        InputError
            If the file cannot be read, or is no longer the same.
        """
        channels = names or tuple(channel.name for channel in self.whole.channels)
        tacho = self.whole.tacho if self.whole.tacho in channels else None
        settings = of_channels(self.settings, channels, tacho)
        first = 0
        with one_line_refusals(), refusals_of(self.path):
            for part in block_parts(self.path, _kind(self.path, settings), settings, samples=self.samples):
                size = part.recording.channels[0].samples.size
                yield self._placed(part, first, channels)
                first += size
            if first != self.whole.channels[0].samples.size:
                raise InputError(f"now holds {first} samples; it has changed while it was read")

    def in_memory(self, *names: str) -> Recording:
        """Return the recording with all samples of some channels; the others stay without.

        Parameters
        ----------
        *names : str
            The channels; all if left out.

        Returns
        -------
        Recording

        Raises
        ------
        InputError
            If they are more than a recording in memory may have, or the file cannot be read.
        """
        wanted = names or tuple(channel.name for channel in self.whole.channels)
        size = self.whole.channels[0].samples.size
        if size * len(wanted) > MAX_VALUES:
            raise InputError(
                f"{self.source}: all samples of {', '.join(wanted[:4])} are needed at once, for the phase of the mesh "
                f"or a tacho of kind counts, angle or speed, and they are {size * len(wanted)} numbers, more than "
                f"{MAX_VALUES}; cut the recording, choose fewer channels, or give a tacho with the waveform of pulses"
            )
        samples = {name: np.empty(size) for name in wanted}
        first = 0
        for part in self.parts(*wanted):
            for channel in part.channels:
                samples[channel.name][first : first + channel.samples.size] = channel.samples
            first += part.channels[0].samples.size
        channels = tuple(
            Channel(
                name=channel.name, samples=samples[channel.name], sampling_rate=channel.sampling_rate,
                unit=channel.unit, rate_from=channel.rate_from, start=channel.start,
            ) if channel.name in samples else channel
            for channel in self.whole.channels
        )  # fmt: skip
        return replace(self.whole, channels=channels)

    def overview(self) -> pd.DataFrame:
        """Return the table of :meth:`Recording.overview`; clipped samples, spikes and drop-outs are missing in it."""
        return self.whole.overview()

    def _placed(self, part: BlockPart, first: int, names: tuple[str, ...]) -> Recording:
        """Return a part with the rate of the whole recording and its place in it."""
        channels = []
        for name in names:
            whole = self.whole.channel(name)
            start = whole.start + first / whole.sampling_rate
            channel = part.recording.channel(name)
            channels.append(replace(channel, sampling_rate=whole.sampling_rate, start=start, rate_from=whole.rate_from))
        return replace(part.recording, channels=tuple(channels), zero_time=self.whole.zero_time, notes=())


def read_in_blocks(
    path: str | os.PathLike[str], *, samples: int | None = None, **options: Unpack[RecordingOptions]
) -> RecordingBlocks:
    """Read a recording that may be larger than memory, in blocks.

    The whole file is read once: its blocks are checked as :func:`read_recording` checks a file, and that they go on
    from each other, at one sampling rate, which all channels have. Text, also gzipped, LVM, WAV, Parquet, NPY, HDF5,
    MAT 7.3, TDMS and MDF are read so.

    Parameters
    ----------
    path : str or path-like
        The file.
    samples : int, optional
        Samples of a block, at least 256; so many that a block holds about 4 million numbers if left out.
    **options
        Fields of :class:`RecordingSettings`, as in :func:`read_recording`.

    Returns
    -------
    RecordingBlocks

    Raises
    ------
    InputError
        If the file cannot be read as a recording, or not in blocks. Samples that are missing at the edge of a block
        are refused too.

    Examples
    --------
    >>> import numpy as np
    >>> np.save("run.npy", np.sin(np.arange(50_000) / 10))
    >>> recording = read_in_blocks("run.npy", sampling_rate=10_000)
    >>> recording.overview()[["channel", "samples", "greatest"]].round(3).to_dict("records")
    [{'channel': 'column', 'samples': 50000, 'greatest': 1.0}]
    """
    path = Path(path)
    if samples is not None and samples < SHORTEST_BLOCK:
        raise InputError(f"samples = {samples} must be at least {SHORTEST_BLOCK}, or left out")
    with one_line_refusals():
        settings = recording_settings(path, options)
        with refusals_of(path):
            kind = _kind(path, settings)
            chosen, whole = surveyed(path, kind, settings, samples=samples)
    return RecordingBlocks(whole=whole, path=path, settings=chosen, samples=samples)


def read_of_any_size(
    path: str | os.PathLike[str], *, in_blocks: bool = False, **options: Unpack[RecordingOptions]
) -> Recording | RecordingBlocks:
    """Read a recording, in blocks if it is too large or if that is wanted.

    Parameters
    ----------
    path : str or path-like
        The file.
    in_blocks : bool
        Whether it is read in blocks, whatever its size.
    **options
        As in :func:`read_recording`.

    Returns
    -------
    Recording or RecordingBlocks

    Raises
    ------
    InputError
        If the file cannot be read as a recording.
    """
    if in_blocks:
        return read_in_blocks(path, **options)
    try:
        return read_recording(path, **options)
    except TooLargeError as error:
        if not error.in_blocks:
            raise
    return read_in_blocks(path, **options)


def _kind(path: Path, settings: RecordingSettings) -> FileKind:
    """Return the format of a file that is read in blocks."""
    if not path.is_file():
        raise InputError("a folder is not read in blocks; read its files" if path.is_dir() else "no such file")
    names = ", ".join(kind.name for kind in KINDS if kind.blocks is not None)
    if settings.file_format is None and is_archive(path):
        raise InputError(f"is an archive, which is not read in blocks; unpack it, formats that are: {names}")
    kind = file_kind(path, settings.file_format)
    if kind.blocks is None:
        raise InputError(f"is {kind.name}, which is not read in blocks; write it as one of {names}, or cut it")
    return kind
