"""Settings of the synchronous average of a recording."""

from typing import Annotated, TypedDict

from pydantic import Field, Strict

from sigdb.core import Section, quantity


class AveragingSettings(Section):
    """Settings of the synchronous average of a recording: channel, gear, shaft angle and length."""

    channel: str | None = Field(default=None, description="Signal to average; the recording's first if left out.")
    teeth: int | None = quantity(
        "-", "Tooth count of the gear on the averaged shaft; the recording's or the rig's if left out.", ge=1,
        default=None,
    )  # fmt: skip
    gear: str | None = Field(default=None, description="The rig's gear on the averaged shaft.")
    mesh_phase: bool = Field(
        default=False, description="Take the angle from the phase of a mesh harmonic; tooth numbers are then relative."
    )
    constant_speed: bool = Field(
        default=False,
        description="Take the stated speed as constant and exact, without tacho or mesh; teeth are then relative.",
    )
    harmonic: int | None = quantity(
        "-", "Mesh harmonic whose phase is taken; the most even of the first three if left out.", ge=1, default=None
    )
    speed_rpm: float | None = quantity(
        "rev/min", "Speed of the averaged shaft within 5 %, for the phase of the mesh.", gt=0, default=None
    )
    speed_range_rpm: Annotated[tuple[float, float], Strict(False)] | None = quantity(
        "rev/min", "Range in which that speed is searched.", default=None
    )
    samples_per_tooth: int = quantity("-", "Samples of the average in a tooth pass.", ge=1, default=64)
    revolutions: int | None = quantity(
        "-", "Revolutions to average; as many whole tooth cycles as there are if left out.", ge=1, default=None
    )
    envelope_band: Annotated[tuple[float, float], Strict(False)] | None = Field(
        default=None, description="Band of the envelope spectrum, in orders; the most impulsive if left out."
    )


class AngleOptions(TypedDict, total=False):
    """Fields of :class:`AveragingSettings` on channel, angle and length, as keyword arguments."""

    channel: str | None
    mesh_phase: bool
    constant_speed: bool
    harmonic: int | None
    speed_rpm: float | None
    speed_range_rpm: tuple[float, float] | None
    revolutions: int | None
    envelope_band: tuple[float, float] | None


class AveragingOptions(AngleOptions, total=False):
    """Fields of :class:`AveragingSettings` as keyword arguments."""

    teeth: int | None
    gear: str | None
    samples_per_tooth: int
