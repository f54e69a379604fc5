"""Settings of reading a recording: options of ``read_recording``, and keys of a side file."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, TypedDict

from pydantic import Field, Strict

from sigdb.core import Section, quantity

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
    variable: str | None = Field(
        default=None, description="Array, structure or group of a file that holds several (MAT, HDF5, NPZ, TDMS)."
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
    pulses_per_rev: float = quantity("-", "Pulses of the tacho in one revolution of its shaft.", gt=0, default=1.0)
    ratio: float = quantity("-", "Revolutions of the shaft of interest in one of the tacho's shaft.", gt=0, default=1.0)
    teeth: int | None = quantity("-", "Tooth count of the gear of interest.", ge=1, default=None)
    speed_rpm: float | None = quantity("rev/min", "Mean speed of the shaft of interest.", gt=0, default=None)
    torque: float | None = quantity("N m", "Torque on the shaft of interest.", default=None)


class FileOptions(TypedDict, total=False):
    """Fields of :class:`RecordingSettings` except the torque, as keyword arguments; None leaves a field out."""

    sampling_rate: float | None
    names: Sequence[str] | None
    channels: Sequence[str] | None
    units: str | Mapping[str, str] | None
    scale: float | Mapping[str, float] | None
    time: str | Literal[False] | None
    variable: str | None
    separator: Literal[",", ";", "\t", " "] | None
    decimal: Literal[".", ","] | None
    longest_gap: int | None
    tacho: str | None
    pulses_per_rev: float | None
    ratio: float | None
    teeth: int | None
    speed_rpm: float | None


class RecordingOptions(FileOptions, total=False):
    """Fields of :class:`RecordingSettings` as keyword arguments; None leaves a field out."""

    torque: float | None
