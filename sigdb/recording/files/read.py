"""Reading of a recording from a file, its side file and options."""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from sigdb.core import InputError, Note, read_toml, validated
from sigdb.recording.files.assemble import assemble
from sigdb.recording.files.formats.contents import Contents, TooLargeError
from sigdb.recording.files.kinds import KINDS, FileKind, file_kind, suffix_of
from sigdb.recording.files.parts.members import archive_files, folder_files, is_archive
from sigdb.recording.files.parts.read_parts import read_parts
from sigdb.recording.files.settings import RecordingOptions, RecordingSettings
from sigdb.recording.recording import Recording

LARGEST_SIDE_FILE = 2**20
"""Largest size of a side file, bytes."""


def read_recording(path: str | os.PathLike[str], **options: Unpack[RecordingOptions]) -> Recording:
    """Read a recording from a file, or from the files of a folder or a ZIP archive.

    Text (CSV, TXT and others, also gzipped), LabVIEW text (LVM), MAT of version 4, 5 to 7 and 7.3, HDF5, NPZ, NPY,
    Parquet, Excel (XLSX, XLSM, XLS), WAV, UFF58, TDMS and MDF of version 4 are read. The suffix and the first bytes of
    a file state the format, and they must agree. A side file of the same name with the suffix ``.toml`` may give the
    options too; keyword arguments win. ``notes`` of the result say what was changed on reading, for instance that
    missing samples were filled; :meth:`Recording.overview` is a table of what was read and left out.

    The files of a folder or ZIP archive are joined in the order of their names: end to end where their times follow
    each other, side by side where each holds one channel. ``parts`` says which where the files do not. Gaps are
    refused.

    Numbers are those of the file, as float64: integers are not scaled, except in WAV, where full scale is 1.

    Parameters
    ----------
    path : str or path-like
        The file, folder or archive.
    **options
        Fields of :class:`RecordingSettings`. The most common are:

        - ``sampling_rate``, Hz, where neither the file nor a column of times states it;
        - ``channels``, the names of the channels to read;
        - ``units`` of all channels, or of each by name;
        - ``tacho``, the channel with the tacho, with ``pulses_per_rev``, ``ratio`` and ``tacho_kind``;
        - ``variable``, the array, structure or group to read from a file that holds several;
        - ``file_format``, a suffix such as "csv", where the suffix of the file does not state its format.

        The others are ``names``, ``scale``, ``time``, ``parts``, ``separator``, ``decimal``, ``longest_gap``,
        ``threshold``, ``hysteresis``, ``edge``, ``teeth``, ``speed_rpm``, ``torque`` and
        ``load``.

    Returns
    -------
    Recording
        Channels of float64 samples without gaps. Channels of one sampling rate have the same number of samples.

    Raises
    ------
    InputError
        If the file cannot be read as a recording, or is larger than a gibibyte or 2^27 numbers; then
        :func:`sigdb.recording.read_in_blocks` may read it. The message is one line with the reason and the remedy.
        Files are not trusted: nothing in them is run, and the memory that they ask for is bounded (see the guide).

    Examples
    --------
    >>> with open("run.csv", "w") as file:
    ...     rows = [f"{i / 10},{i % 7},{i % 5}" for i in range(50)]
    ...     _ = file.write("\\n".join(["time [ms],a1 [m/s^2],a2", *rows]))
    >>> recording = read_recording("run.csv")
    >>> [(channel.name, channel.unit, channel.samples.size, channel.sampling_rate) for channel in recording.channels]
    [('a1', 'm/s^2', 50, 10000.0), ('a2', '', 50, 10000.0)]
    >>> [note.text for note in recording.notes]
    ['sampling rate 10000 Hz from column time, in ms']
    """
    path = Path(path)
    with one_line_refusals():
        return _read(path, recording_settings(path, options))


@contextmanager
def one_line_refusals() -> Iterator[None]:
    """Make the messages of refusals a line of bounded length."""
    try:
        yield
    except TooLargeError as error:
        raise TooLargeError(_one_line(str(error)), in_blocks=error.in_blocks) from None
    except InputError as error:
        raise InputError(_one_line(str(error))) from None


def _read(path: Path, settings: RecordingSettings) -> Recording:
    if path.is_dir():
        return _prefixed(path, lambda: read_parts(path, *folder_files(path), settings, _read_file))
    if not path.is_file():
        raise InputError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    if settings.file_format is None and is_archive(path):
        return _prefixed(path, lambda: read_parts(path, *archive_files(path), settings, _read_file))
    return _prefixed(path, lambda: _read_file(path, settings))


def _prefixed(path: Path, read: Callable[[], Recording]) -> Recording:
    """Return a recording; errors begin with the path."""
    with refusals_of(path):
        return read()


@contextmanager
def refusals_of(path: Path) -> Iterator[None]:
    """Make refusals begin with the path of a file."""
    try:
        yield
    except TooLargeError as error:
        raise TooLargeError(_after(path, error), in_blocks=error.in_blocks) from None
    except InputError as error:
        raise InputError(_after(path, error)) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _after(path: Path, error: Exception) -> str:
    return f"{path}: {error}".replace(f"{path}: {path}: ", f"{path}: ")


def _read_file(path: Path, settings: RecordingSettings) -> Recording:
    kind = file_kind(path, settings.file_format)
    with foreign_errors(kind):
        contents = kind.read(path, settings)
    return assemble(with_format(contents, kind, path, settings), settings, source=str(path))


@contextmanager
def foreign_errors(kind: FileKind) -> Iterator[None]:
    """Turn errors of a format's library into refusals, and say how a file is read that is too large."""
    try:
        yield
    except TooLargeError as error:
        in_blocks = kind.blocks is not None
        names = ", ".join(other.name for other in KINDS if other.blocks is not None)
        how = "read it in blocks: sigdb.recording.read_in_blocks, as sigdb signature and diagnose do"
        remedy = how if in_blocks else f"write it as one of {names}"
        raise TooLargeError(f"{error}, or {remedy}", in_blocks=in_blocks) from None
    except InputError:
        raise
    except kind.foreign as error:
        raise InputError(f"cannot be read as {kind.name} ({_described(error)})") from None


def with_format(contents: Contents, kind: FileKind, path: Path, settings: RecordingSettings) -> Contents:
    """Return the contents with a note on the format where only the first bytes of the file state it."""
    if settings.file_format is not None or suffix_of(path) in kind.suffixes:
        return contents
    text = f"read as {kind.name} by its first bytes"
    note = Note(code="format-by-content", text=text, values={"format": kind.name})
    return replace(contents, notes=(note, *contents.notes))


def recording_settings(path: Path, options: Mapping[str, object]) -> RecordingSettings:
    """Return the settings from the side file and the options; the options win, and None leaves one out."""
    options = {name: value for name, value in options.items() if value is not None}
    named = path if path.name not in ("", "..") else path.resolve()  # the side file of a folder bears its name
    side = named.with_name(named.name[: len(named.name) - len(suffix_of(named))] + ".toml") if named.name else named
    stated: dict[str, Any] = {}
    if side != named and side.is_file():
        if side.stat().st_size > LARGEST_SIDE_FILE:
            raise InputError(f"{side}: larger than {LARGEST_SIDE_FILE} bytes, so no side file of a recording")
        stated = read_toml(side)
        validated(RecordingSettings, stated, owner=str(side))
    return validated(RecordingSettings, {**stated, **_plain_mappings(options)}, owner="read_recording")


def _plain_mappings(options: Mapping[str, object]) -> dict[str, object]:
    """Return the options with any mapping as a dictionary."""
    return {name: dict(value) if isinstance(value, Mapping) else value for name, value in options.items()}


def _described(error: Exception) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


def _one_line(message: str) -> str:
    """Return a message of bounded length without line ends or other signs that a terminal would obey."""
    line = "; ".join(part.strip() for part in message.splitlines() if part.strip())
    shown = "".join(sign if sign.isprintable() else "?" for sign in line)
    return shown if len(shown) <= 600 else f"{shown[:597]}..."
