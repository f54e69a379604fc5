"""Settings of reading a recording: options of ``read_recording``, and keys of a side file."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, TypedDict

from pydantic import BeforeValidator, Field, Strict

from sigdb.core import Section, quantity
from sigdb.recording.recording import Edge, TachoKind


def _number_or_fraction(value: object) -> object:
    """Return the number that a text such as '19/48' or '0.4' states; anything else as it is."""
    if not isinstance(value, str):
        return value
    above, slash, below = value.partition("/")
    try:
        return float(above) / float(below) if slash else float(value)
    except (ValueError, ZeroDivisionError):
        raise ValueError("must be a number, or a fraction such as 19/48") from None


Ratio = Annotated[float, BeforeValidator(_number_or_fraction)]
"""A number, or a fraction as text."""

Names = Annotated[tuple[str, ...], Strict(False), Field(min_length=1)]


class RecordingSettings(Section):
    """Settings of reading a file as a recording, and facts about the shaft that no file states."""

    sampling_rate: float | None = quantity(
        "Hz", "Sampling rate of all channels; it wins over a rate in the file.", gt=0, le=1e9, default=None
    )
    names: Names | None = Field(default=None, description="Names of all columns of the file, in its order.")
    channels: Names | None = Field(default=None, description="Columns to read, by name; all if left out.")
    units: str | dict[str, str] | None = Field(default=None, description="Unit of all channels, or of each by name.")
    scale: float | dict[str, float] | None = Field(
        default=None, description="Factor on the stored numbers, of all channels but the tacho, or of each by name."
    )
    time: str | Literal[False] | None = Field(
        default=None, description="Column of times, s; false if there is none; found automatically if left out."
    )
    file_format: str | None = Field(
        default=None,
        description="Format of the file, by a suffix such as 'csv'; by the file's suffix and first bytes if left out.",
    )
    variable: str | None = Field(
        default=None, description="Array, structure or group of a file that holds several (MAT, HDF5, NPZ, TDMS)."
    )
    parts: Literal["contiguous", "channels"] | None = Field(
        default=None,
        description="How the files of a folder or ZIP archive belong together: each follows the one before without a "
        "gap, or each is a channel of one measurement; by their times if left out.",
    )
    separator: Literal[",", ";", "\t", " "] | None = Field(
        default=None, description="Sign between the numbers of a text file; found automatically if left out."
    )
    decimal: Literal[".", ","] | None = Field(
        default=None, description="Decimal sign of a text file; found automatically if left out."
    )
    longest_gap: int = quantity(
        "-", "Longest run of missing samples that a straight line fills.", ge=0, le=1000, default=5
    )
    tacho: str | None = Field(default=None, description="Channel with the tacho.")
    pulses_per_rev: float = quantity(
        "-", "Pulses, or counts of an encoder, in one revolution of the tacho's shaft.", gt=0, default=1.0
    )
    tacho_kind: TachoKind = Field(
        default="waveform",
        description="Quantity that the tacho holds: a waveform with pulses, the times of pulses, counts of an encoder, "
        "an angle, or a speed.",
    )
    threshold: float | None = quantity(
        "-", "Level of the tacho at which a pulse begins, in its unit; found automatically if left out.", default=None
    )
    hysteresis: float | None = quantity(
        "-",
        "Depth below the threshold to which the tacho must return before its next pulse, in its unit.",
        gt=0,
        default=None,
    )
    edge: Edge | None = Field(
        default=None, description="Edge of the tacho that counts, rising or falling; found automatically if left out."
    )
    ratio: Ratio = quantity(
        "-",
        "Revolutions of the shaft of interest in one of the tacho's shaft, also as a fraction, '19/48'.",
        gt=0,
        default=1.0,
    )
    teeth: int | None = quantity("-", "Tooth count of the gear of interest.", ge=1, default=None)
    speed_rpm: float | None = quantity("rev/min", "Mean speed of the shaft of interest.", gt=0, default=None)
    torque: float | None = quantity("N m", "Torque on the shaft of interest.", default=None)
    load: float | None = quantity(
        "%",
        "Load of the machine, where no torque is known; in per cent of the rated load, or any unit of all.",
        default=None,
    )


class FileOptions(TypedDict, total=False):
    """Fields of :class:`RecordingSettings` except teeth, torque and load, as keywords; None leaves a field out."""

    sampling_rate: float | None
    names: Sequence[str] | None
    channels: Sequence[str] | None
    units: str | Mapping[str, str] | None
    scale: float | Mapping[str, float] | None
    time: str | Literal[False] | None
    file_format: str | None
    variable: str | None
    parts: Literal["contiguous", "channels"] | None
    separator: Literal[",", ";", "\t", " "] | None
    decimal: Literal[".", ","] | None
    longest_gap: int | None
    tacho: str | None
    pulses_per_rev: float | None
    tacho_kind: TachoKind | None
    threshold: float | None
    hysteresis: float | None
    edge: Edge | None
    ratio: float | str | None
    speed_rpm: float | None


class RecordingOptions(FileOptions, total=False):
    """Fields of :class:`RecordingSettings` as keyword arguments; None leaves a field out."""

    teeth: int | None
    torque: float | None
    load: float | None
