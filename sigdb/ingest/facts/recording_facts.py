"""Facts about a recording that its file does not state: gear, sensor, operating point, date, machine, labels."""

from datetime import datetime
from typing import Literal, Self

from pydantic import Field, field_validator, model_validator

from sigdb.core import Section, quantity
from sigdb.ingest.facts.damage_kinds import NONE, UNKNOWN, checked_kind, kind_of

HEALTHY, DAMAGED = "healthy", "damaged"

Trust = Literal["inspected", "seeded", "stated", "assumed", "unknown"]


class RecordingFacts(Section):
    """A line of the table of recordings: what is known of a file, or of a gear or channel in it."""

    file: str = Field(description="Name of the file, below the folder of the recordings or of the table.")
    rig: str | None = Field(default=None, description="Built-in rig or TOML file.")
    teeth: str | None = Field(
        default=None, description="Instead of a rig: tooth count of the averaged gear and of its mate, 32/80, or 32."
    )
    gear: str | None = Field(default=None, description="Averaged gear of the rig; several are joined by +.")
    channel: str | None = Field(default=None, description="Channel of the file; several are joined by +.")
    sensor: str | None = Field(default=None, description="Name of the sensor; that of the channel if left out.")
    load: float | None = Field(default=None, description="Load in any one unit, such as per cent.")
    speed_rpm: float | None = quantity("rev/min", "Speed of the averaged shaft.", gt=0, default=None)
    torque: float | None = quantity("N m", "Torque on the drive shaft.", default=None)
    date: str | None = Field(default=None, description="Date, or date and time, by ISO 8601: 2026-03-01T08:30.")
    machine: str | None = Field(default=None, description="Name of the machine.")
    specimen: str | None = Field(default=None, description="Name of the pair of gears, which a repair replaces.")
    set: str | None = Field(default=None, description="Name of the set of recordings, such as a published one.")
    state: str | None = Field(default=None, description="State of the gear in the words of the source.")
    tooth: int | None = quantity(
        "-", "First damaged tooth; 0 for an undamaged gear, unknown if left out.", ge=0, default=None
    )
    damaged_teeth: int | None = quantity("-", "Number of damaged teeth.", ge=0, default=None)
    kind: str | None = Field(default=None, description="Kind of damage by ISO 10825:1995, none, other or unknown.")
    severity: str | None = Field(default=None, description="Severity in the words or numbers of the source.")
    stiffness_loss: float | None = quantity(
        "-", "Fraction of the tooth's mesh stiffness that is lost, where it is known.", ge=0, le=1, default=None
    )
    phase_shift_deg: float | None = quantity("deg", "Delay of the tooth's stiffness, where it is known.", default=None)
    label_trust: Trust | None = Field(
        default=None,
        description="How far the labels can be trusted: inspected (somebody saw the tooth), seeded (made on purpose), "
        "stated (by the source), assumed, or unknown.",
    )
    tacho: str | None = Field(default=None, description="Channel with the tacho.")
    sampling_rate: float | None = quantity("Hz", "Sampling rate.", gt=0, default=None)
    pulses_per_rev: float | None = quantity("-", "Pulses of the tacho in a revolution.", gt=0, default=None)
    ratio: str | None = Field(default=None, description="Revolutions of the averaged shaft in one of the tacho's.")
    unit: str | None = Field(default=None, description="Unit of the signals.")

    @field_validator("date")
    @classmethod
    def _is_a_date(cls, date: str | None) -> str | None:
        if date is None:
            return None
        try:
            moment = datetime.fromisoformat(date)
        except ValueError:
            raise ValueError(f"{date!r} is no date by ISO 8601, such as 2026-03-01 or 2026-03-01T08:30") from None
        return date.strip() if len(date.strip()) == len("2026-03-01") else moment.isoformat()

    @field_validator("kind")
    @classmethod
    def _is_a_kind(cls, kind: str | None) -> str | None:
        return None if kind is None else checked_kind(kind)

    @model_validator(mode="after")
    def _labels_agree(self) -> Self:
        if len(self._healths) > 1:
            labels = {"state": self.state, "tooth": self.tooth, "kind": self.kind}
            listed = ", ".join(f"{name} = {value!r}" for name, value in labels.items() if value is not None)
            raise ValueError(
                f"{listed} contradict each other: some say that the gear is damaged, others that it is not"
            )
        return self

    @property
    def _healths(self) -> frozenset[str]:
        """The healths that the labels state."""
        kinds = {kind for kind in (self.kind, kind_of(self.state or UNKNOWN)) if kind not in (None, UNKNOWN)}
        stated = {HEALTHY if kind == NONE else DAMAGED for kind in kinds}
        return frozenset(stated if self.tooth is None else {*stated, DAMAGED if self.tooth else HEALTHY})

    @property
    def health(self) -> str:
        """``healthy``, ``damaged`` or ``unknown``."""
        return next(iter(self._healths), UNKNOWN)

    @property
    def damage_kind(self) -> str:
        """Kind of damage; that which the word for the state means where none is stated."""
        stated = self.kind if self.kind not in (None, UNKNOWN) else kind_of(self.state or UNKNOWN)
        return NONE if self.health == HEALTHY else stated or UNKNOWN

    @property
    def labels(self) -> dict[str, str | int | float | None]:
        """Values of the columns of labels; None where a number is unknown."""
        health, healthy = self.health, self.health == HEALTHY
        return {
            "tooth": 0 if healthy else self.tooth,
            "damaged_teeth": 0 if healthy else self.damaged_teeth,
            "stiffness_loss": 0.0 if healthy else self.stiffness_loss,
            "phase_shift_deg": 0.0 if healthy else self.phase_shift_deg,
            "state": self.state or UNKNOWN,
            "health": health,
            "kind": self.damage_kind,
            "severity": self.severity or (NONE if healthy else UNKNOWN),
            "label_trust": self.label_trust or (UNKNOWN if health == UNKNOWN else "stated"),
        }


LABELS = (
    "tooth",
    "damaged_teeth",
    "stiffness_loss",
    "phase_shift_deg",
    "state",
    "health",
    "kind",
    "severity",
    "label_trust",
)
"""Columns of labels, which findings of an inspection may change afterwards."""
