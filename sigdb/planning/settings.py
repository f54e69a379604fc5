"""Settings of a plan: the damage to be found, the measurements to choose from, and the noise."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from sigdb.core import Section, in_unit, quantity, suggestion, unit_of
from sigdb.transmission import SIZES, ToothDamage, Transmission

_USUAL_LARGEST = {"stiffness_loss": 0.8, "friction": 0.3}
"""Largest size of a kind of damage that has one; a phase shift has a quarter of a tooth pass."""

ASSUMED_DOUBT_DB = 6.0
"""Doubt of a noise that is assumed."""


class PlanSettings(Section):
    """Settings of a plan."""

    gear: str | None = Field(default=None, description="Damaged gear; the driving gear of the mesh if left out.")
    kind: str = Field(default="stiffness_loss", description="Kind of damage: the name of its size.")
    largest: float | None = quantity(
        "-", "Largest size that is simulated, in the unit of the kind; a usual one if left out.", gt=0, default=None
    )
    damaged_teeth: int = quantity("-", "Number of consecutive damaged teeth.", ge=1, default=1)
    tooth: Literal["unknown", "known"] = Field(
        default="unknown",
        description="Whether the damage may be at any tooth with the same probability, or at one that is known.",
    )
    sensors: Annotated[tuple[str, ...], Strict(False)] = Field(
        default=(), description="Sensors of the rig; all if left out."
    )
    directions: Literal["given", "axes"] = Field(
        default="given", description="Directions of the sensors: theirs, or each axis of the casing's frame."
    )
    speeds_rpm: Annotated[tuple[float, ...], Strict(False)] = quantity(
        "rpm", "Speeds at the rig's drive; 60, 80, 100 and 120 % of the rig's own if left out.", default=()
    )
    torques: Annotated[tuple[float, ...], Strict(False)] = quantity(
        "N m", "Torques at the rig's drive; 50 and 100 % of the rig's own if left out.", default=()
    )
    averages: Annotated[tuple[int, ...], Strict(False)] = quantity(
        "rev", "Averaged revolutions, whole tooth cycles; about 30 and 300 if left out.", default=()
    )
    noise: dict[str, float] = Field(
        default={},
        description="Standard deviation of one revolution's noise by sensor, in its unit, over the average's band.",
    )
    snr_db: float | None = quantity(
        "dB",
        "Signal-to-noise ratio of one revolution at the rig's own operating point, of the sensor with the greatest "
        "signal of its unit; 0 is assumed if left out.",
        default=None,
    )
    noise_doubt_db: float | None = quantity(
        "dB", "Doubt of the noise; 0 where it is stated and 6 where it is assumed, if left out.", ge=0, default=None
    )
    index_error: float = quantity(
        "m", "Standard deviation of the index errors of the gear, which are not known.", ge=0, default=2e-6
    )
    false_alarm_rate: float = quantity("-", "Probability of an alarm without damage.", gt=0, lt=0.5, default=1e-3)
    samples_per_tooth: int = quantity("-", "Samples of the average in a tooth pass.", ge=16, le=512, default=32)
    draws: int = quantity("-", "Averages that are drawn for each size.", ge=200, le=1_000_000, default=1000)
    seed: int = quantity("-", "Seed of the draws.", ge=0, default=0)

    @model_validator(mode="before")
    @classmethod
    def _read_largest(cls, data: object) -> object:
        """Read the largest size from a text, with a unit of the kind's."""
        if not isinstance(data, Mapping) or not isinstance(text := data.get("largest"), str):
            return data
        kind = str(data.get("kind", cls.model_fields["kind"].default))
        if kind not in SIZES:
            return {**data, "largest": None}
        unit = unit_of(ToothDamage.model_fields[kind])
        try:
            return {**data, "largest": float(text)}
        except ValueError:
            return {**data, "largest": in_unit(text, unit)}

    @model_validator(mode="after")
    def _consistent(self) -> "PlanSettings":
        problems = []
        if self.kind not in SIZES:
            problems.append(f"kind = {self.kind!r} is no size of a tooth's damage{suggestion(self.kind, SIZES)}")
        problems += [
            f"{name} = {value:g} must be greater than 0"
            for name in ("speeds_rpm", "torques", "averages")
            for value in getattr(self, name)
            if value <= 0
        ]
        problems += [
            f"noise of {name} = {value:g} must be greater than 0" for name, value in self.noise.items() if value <= 0
        ]
        problems += [
            f"{name} lists a value twice; list each once"
            for name in ("sensors", "speeds_rpm", "torques", "averages")
            if len({*getattr(self, name)}) < len(getattr(self, name))
        ]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @property
    def unit(self) -> str:
        """Unit of the size of the damage."""
        return unit_of(ToothDamage.model_fields[self.kind])

    def largest_size(self, teeth: int) -> float | None:
        """Return the largest size to simulate on a gear of that many teeth; None for a kind without a usual one."""
        if self.largest is None and self.kind == "phase_shift_deg":
            return 90 / teeth
        return self.largest or _USUAL_LARGEST.get(self.kind)

    def speeds(self, rig: Transmission) -> tuple[float, ...]:
        """Return the speeds at the drive of a rig, rpm."""
        return self.speeds_rpm or tuple(part * rig.operating.speed_rpm for part in (0.6, 0.8, 1.0, 1.2))

    def torques_of(self, rig: Transmission) -> tuple[float, ...]:
        """Return the torques at the drive of a rig, N m."""
        return self.torques or tuple(part * rig.operating.torque for part in (0.5, 1.0))

    @property
    def doubt_db(self) -> float:
        """Doubt of the noise of sensors for which none is stated, dB."""
        if self.noise_doubt_db is not None:
            return self.noise_doubt_db
        return 0.0 if self.snr_db is not None else ASSUMED_DOUBT_DB
