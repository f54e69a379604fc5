"""What a file of a recording may not say by itself: the options of ``read_recording``, and its side file."""

from typing import Annotated, Literal

from pydantic import Field, Strict

from sigdb.core import Section, quantity

Names = Annotated[tuple[str, ...], Strict(False), Field(min_length=1)]
Positive = Annotated[float, Field(gt=0)]


class RecordingSettings(Section):
    """How a file is read as a recording, and what is known of the shaft."""

    sampling_rate: float | None = quantity(
        "Hz", "Sampling rate of all channels; it wins over what the file says.", gt=0, le=1e9, default=None
    )
    names: Names | None = Field(default=None, description="Names of the file's columns, all of them, in its order.")
    channels: Names | None = Field(default=None, description="Columns to read, by name; all if left out.")
    units: str | dict[str, str] | None = Field(default=None, description="Unit of all channels, or of each by name.")
    scale: float | dict[str, float] | None = Field(
        default=None, description="Factor on the stored numbers, of all channels but the tacho, or of each by name."
    )
    time: str | Literal[False] | None = Field(
        default=None, description="Column that holds the time, s; false if none does; found by itself if left out."
    )
    variable: str | None = Field(
        default=None, description="Array, structure or group of a file that holds several (MAT, HDF5, NPZ, TDMS)."
    )
    separator: Literal[",", ";", "\t", " "] | None = Field(
        default=None, description="What stands between the numbers of a text file; found by itself if left out."
    )
    decimal: Literal[".", ","] | None = Field(
        default=None, description="Decimal sign of a text file; found by itself if left out."
    )
    longest_gap: int = quantity(
        "-", "Most missing samples in a row that are filled by a straight line.", ge=0, le=1000, default=5
    )
    tacho: str | None = Field(default=None, description="Channel with the tacho.")
    pulses_per_rev: float = quantity("-", "Pulses of the tacho in one revolution of its shaft.", gt=0, default=1.0)
    ratio: float = quantity("-", "Revolutions of the shaft of interest in one of the tacho's shaft.", gt=0, default=1.0)
    teeth: int | None = quantity("-", "Tooth count of the gear of interest.", ge=1, default=None)
    speed_rpm: float | None = quantity("rev/min", "Mean speed of the shaft of interest.", gt=0, default=None)
    torque: float | None = quantity("N m", "Torque on the shaft of interest.", default=None)
