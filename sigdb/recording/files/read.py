"""``read_recording``: a file, its side file and options to a recording."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sigdb.core import InputError, read_toml, validated
from sigdb.recording.files.assemble import assemble
from sigdb.recording.files.kinds import file_kind, suffix_of
from sigdb.recording.files.settings import RecordingSettings
from sigdb.recording.recording import Recording

LARGEST_SIDE_FILE = 2**20
"""Bytes."""


def read_recording(
    path: str | os.PathLike[str],
    *,
    sampling_rate: float | None = None,
    channels: Sequence[str] | None = None,
    units: str | Mapping[str, str] | None = None,
    tacho: str | None = None,
    pulses_per_rev: float | None = None,
    variable: str | None = None,
    **more: Any,
) -> Recording:
    """Read a recording from a file.

    Text (CSV, TXT, also gzipped), MAT of version 5 and 7.3, WAV, HDF5, Parquet, NPZ, NPY, UFF58 and TDMS are read. The
    format is told by the suffix and by the first bytes, which must agree. A file beside it, of the same name with the
    suffix ``.toml``, may give the options; those given here win. What was handled on reading, for instance missing
    samples that were filled, is in ``notes`` of the result.

    Numbers are those of the file, as float64: integers are not scaled, except in WAV, where full scale is 1.

    Parameters
    ----------
    path
        The file.
    sampling_rate
        Hz. Needed where neither the file nor a column of times tells it.
    channels
        Names of the channels to read, in that order; all if left out.
    units
        Unit of all channels, or of each by name.
    tacho
        Channel with the tacho.
    pulses_per_rev
        Pulses of the tacho in one revolution of its shaft; 1 if left out.
    variable
        Array, structure or group of a file that holds several.
    more
        The other fields of :class:`RecordingSettings`: ``names``, ``scale``, ``time``, ``separator``, ``decimal``,
        ``longest_gap``, ``ratio``, ``teeth``, ``speed_rpm``, ``torque``.

    Returns
    -------
    Recording
        Channels of float64 samples without gaps. Those of one sampling rate have the same number of samples.

    Raises
    ------
    InputError
        If the file cannot be read as a recording, in one line that says why and what to do. Files are taken as coming
        from anywhere: nothing in them is run, and what they ask for is bounded (see the guide).

    Examples
    --------
    >>> with open("run.csv", "w") as file:
    ...     rows = [f"{i / 10},{i % 7},{i % 5}" for i in range(50)]
    ...     _ = file.write("\\n".join(["time [ms],a1 [m/s^2],a2", *rows]))
    >>> recording = read_recording("run.csv")
    >>> [(one.name, one.unit, one.samples.size, one.sampling_rate) for one in recording.channels]
    [('a1', 'm/s^2', 50, 10000.0), ('a2', '', 50, 10000.0)]
    >>> recording.notes
    ('sampling rate 10000 Hz from column time, in ms',)
    """
    path = Path(path)
    options = {
        "sampling_rate": sampling_rate, "channels": channels, "tacho": tacho,
        "units": dict(units) if isinstance(units, Mapping) else units,
        "pulses_per_rev": pulses_per_rev, "variable": variable, **more,
    }  # fmt: skip
    try:
        settings = _settings(path, {name: value for name, value in options.items() if value is not None})
        return _read(path, settings)
    except InputError as error:
        raise InputError(_one_line(str(error))) from None


def _read(path: Path, settings: RecordingSettings) -> Recording:
    if not path.is_file():
        raise InputError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    try:
        kind = file_kind(path)
        try:
            contents = kind.read(path, settings)
        except InputError:
            raise
        except kind.foreign as error:
            raise InputError(f"cannot be read as {kind.name} ({_told(error)})") from None
        return assemble(contents, settings, source=str(path))
    except InputError as error:
        raise InputError(f"{path}: {error}".replace(f"{path}: {path}: ", f"{path}: ")) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _settings(path: Path, options: dict[str, Any]) -> RecordingSettings:
    """What the side file says, and the options over it."""
    side = path.with_name(path.name[: len(path.name) - len(suffix_of(path))] + ".toml")
    stated: dict[str, Any] = {}
    if side != path and side.is_file():
        if side.stat().st_size > LARGEST_SIDE_FILE:
            raise InputError(f"{side}: larger than {LARGEST_SIDE_FILE} bytes, so no side file of a recording")
        try:
            stated = read_toml(side)
        except RecursionError:
            raise InputError(f"{side}: not valid TOML: nested too deeply") from None
        validated(RecordingSettings, stated, owner=str(side))
    return validated(RecordingSettings, stated | options, owner="read_recording")


def _told(error: Exception) -> str:
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


def _one_line(message: str) -> str:
    """A message without line ends or other signs that a terminal would obey, and of bounded length."""
    line = "; ".join(part.strip() for part in message.splitlines() if part.strip())
    shown = "".join(sign if sign.isprintable() else "?" for sign in line)
    return shown if len(shown) <= 600 else f"{shown[:597]}..."
