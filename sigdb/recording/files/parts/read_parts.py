"""Reading of a recording from the files of a folder or a ZIP archive."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from sigdb.core import InputError, Note, suggestion
from sigdb.recording.files.formats.contents import check_values
from sigdb.recording.files.kinds import file_kind
from sigdb.recording.files.parts.join import RecordingPart, join
from sigdb.recording.files.parts.members import MemoryFile
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.recording import Channel, Recording

IN_MEMORY = {
    "text", "gzip", "LVM", "MAT version 4", "MAT version 5", "WAV", "Parquet", "NPZ", "NPY", "UFF", "TDMS",
}  # fmt: skip
"""Formats whose readers take a file in memory."""

BY_NAME = {"channels": None, "tacho": None, "names": None, "units": None, "scale": None}
"""Settings that name channels; the channels of files with one channel each get their names when they are joined."""


def read_parts(
    path: Path,
    files: Iterable[Path | MemoryFile],
    left_out: list[str],
    settings: RecordingSettings,
    read_file: Callable[[Path, RecordingSettings], Recording],
) -> Recording:
    """Return the recording in the files of a folder or archive.

    Parameters
    ----------
    path
        The folder or archive.
    files
        Its files, in the order of their names.
    left_out
        Names of files that are not read.
    settings
        Settings of the recording.
    read_file
        Reader of one file.

    Raises
    ------
    InputError
        If a file cannot be read, or the files do not belong together.
    """
    parts: list[RecordingPart] = []
    single = False
    total = 0
    for file in files:
        try:
            if isinstance(file, MemoryFile):
                _check_kind(file, settings)
            if not parts:
                single = len(read_file(cast(Path, file), _unnamed(settings)).channels) == 1
            # Readers use those methods of a path that a file in memory has.
            recording = read_file(cast(Path, file), _unnamed(settings) if single else settings)
        except InputError as error:
            raise InputError(f"{file.name}: {error}") from None
        total += sum(channel.samples.size for channel in recording.channels)
        check_values(total)
        parts.append(RecordingPart(name=file.stem, recording=recording))
    recording = join(parts, settings, source=str(path))
    if single:
        recording = _with_settings(recording, settings)
    if not left_out:
        return recording
    text = f"{', '.join(left_out[:8])}: not read"
    note = Note(code="files-left-out", text=text, values={"files": len(left_out)})
    return replace(recording, notes=(*recording.notes, note))


def _check_kind(file: MemoryFile, settings: RecordingSettings) -> None:
    name = file_kind(cast(Path, file), settings.file_format).name
    if name not in IN_MEMORY:
        raise InputError(f"is {name}, which is not read from an archive; unpack it, and give the folder")


def _unnamed(settings: RecordingSettings) -> RecordingSettings:
    return settings.model_copy(update=BY_NAME)


def _with_settings(recording: Recording, settings: RecordingSettings) -> Recording:
    """Return a recording whose channels have the names, units and factors of the settings."""
    channels = recording.channels
    if settings.names is not None:
        if len(settings.names) != len(channels):
            raise InputError(f"names gives {len(settings.names)} names, the files hold {len(channels)} channels")
        channels = tuple(replace(channel, name=name) for channel, name in zip(channels, settings.names, strict=True))
    by_name = {channel.name: channel for channel in channels}
    wanted = [*(settings.channels or by_name), *([settings.tacho] if settings.tacho is not None else [])]
    stated = [*wanted, *_keys(settings.units), *_keys(settings.scale)]
    for name in stated:
        if name not in by_name:
            raise InputError(f"no channel {name!r}{suggestion(name, by_name)}")
    filled = [note for note in recording.notes if note.code == "filled-gaps"]
    if settings.tacho is not None and filled:
        raise InputError(f"{filled[0].text}; samples of a tacho are not filled, so give parts without gaps")
    chosen = tuple(_scaled(by_name[name], settings) for name in dict.fromkeys(wanted))
    return replace(recording, channels=chosen, tacho=settings.tacho)


def _keys(setting: object) -> list[str]:
    return list(setting) if isinstance(setting, dict) else []


def _scaled(channel: Channel, settings: RecordingSettings) -> Channel:
    is_tacho = channel.name == settings.tacho
    unit, factor = channel.unit, 1.0
    if isinstance(settings.units, dict):
        unit = settings.units.get(channel.name, unit)
    elif settings.units is not None and not is_tacho:
        unit = settings.units
    if isinstance(settings.scale, dict):
        factor = settings.scale.get(channel.name, 1.0)
    elif settings.scale is not None and not is_tacho:
        factor = settings.scale
    with np.errstate(over="ignore"):
        samples = channel.samples * factor if factor != 1 else channel.samples
    if not np.isfinite(samples).all():
        raise InputError(f"channel {channel.name}: scale = {factor} makes it infinite")
    return replace(channel, samples=samples, unit=unit)
