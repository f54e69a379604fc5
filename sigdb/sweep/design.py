"""The section ``[sweep]`` of a recipe: which cases are simulated, as a union of grids."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    model_serializer,
    model_validator,
)

from sigdb.core.errors import InputError
from sigdb.core.fields import Section, quantity, without_defaults
from sigdb.measurement import Measurement
from sigdb.transmission import ToothDamage
from sigdb.transmission.damage import FLAW_FIELDS, PRESETS


def _listed(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


Values = Annotated[tuple[float, ...], Strict(False), BeforeValidator(_listed)]
Counts = Annotated[tuple[int, ...], Strict(False), BeforeValidator(_listed)]
Names = Annotated[tuple[str, ...], Strict(False), BeforeValidator(_listed)]
DAMAGE_AXES = ("damaged_teeth", "phase_shift_deg", "stiffness_loss", "loss_extent", "friction", *FLAW_FIELDS)
MEASUREMENT_AXES = ("averages", "snr_db", "index_error")
OWN_AXES = ("tooth", *DAMAGE_AXES, "pattern", *MEASUREMENT_AXES)
"""All axes but those over the rig."""


def check_bounds(axis: str, value: float) -> None:
    """Refuse a value that the field behind an axis does not take.

    Raises
    ------
    ValueError
        Names the axis, the rule and the value.
    """
    if axis == "damaged_teeth" and value < 1:
        raise ValueError(f"damaged_teeth = {value} must be 1 or more; undamaged rows come from healthy")
    section = ToothDamage if axis in ToothDamage.model_fields else Measurement
    if axis in section.model_fields:
        try:
            section(**{axis: value})
        except InputError as error:
            raise ValueError(str(error).removeprefix(f"{section.__name__}: ")) from None


class Grid(Section):
    """A product of axes: every combination is a case. One value is an axis of one point.

    Any numeric field of the rig is an axis by its dotted path, for example ``pinion.teeth = [12, 13]``.
    A combination that damages nothing is left out: undamaged rows come from ``healthy``.
    """

    tooth: Literal["all"] | Counts = quantity(
        "-", "First damaged tooth: a list, or 'all' teeth of the gear.", default="all"
    )
    damaged_teeth: Counts = quantity("-", "Number of consecutive damaged teeth.", default=(1,), min_length=1)
    phase_shift_deg: Values = quantity("deg", "Delay of the tooth's mesh stiffness.", default=(0.0,), min_length=1)
    stiffness_loss: Values = quantity(
        "-", "Fraction of the tooth's mesh stiffness that is lost.", default=(0.0,), min_length=1
    )
    loss_extent: Values = quantity(
        "-", "Fraction of the contact over which the loss acts.", default=(1.0,), min_length=1
    )
    friction: Values = quantity("-", "Coulomb friction coefficient of the tooth.", default=(0.0,), min_length=1)
    crack_depth: Values = quantity("m", "Length of a crack from the root.", default=(0.0,), min_length=1)
    crack_angle_deg: Values = quantity("deg", "Angle of the crack.", default=(70.0,), min_length=1)
    pit_diameter: Values = quantity("m", "Diameter of round pits.", default=(0.0,), min_length=1)
    pit_depth: Values = quantity("m", "Depth of the pits.", default=(0.0,), min_length=1)
    pits: Counts = quantity("-", "Number of pits in a row across the flank.", default=(1,), min_length=1)
    pit_place: Values = quantity("-", "Place of the pits along the contact.", default=(0.5,), min_length=1)
    wear_depth: Values = quantity("m", "Depth worn evenly off the flank.", default=(0.0,), min_length=1)
    chip_height: Values = quantity("m", "Height broken off the tooth.", default=(0.0,), min_length=1)
    chip_extent: Values = quantity("-", "Fraction of the face width broken off.", default=(1.0,), min_length=1)
    pattern: Names = quantity(
        "-",
        "Names of patterns, in place of the axes of damage: those of [sweep.patterns], else pitted, broken, worn.",
        default=(),
    )
    averages: Counts = quantity("rev", "Revolutions in the average; [measurement] if left out.", default=())
    snr_db: Values = quantity("dB", "Signal-to-noise ratio; [measurement] if left out.", default=())
    index_error: Values = quantity("m", "Rms index error; [measurement] if left out.", default=())
    rig: dict[str, Values] = Field(default={}, description="Axes over the rig, by dotted path.")

    @model_validator(mode="before")
    @classmethod
    def _dotted(cls, data: Any) -> Any:
        """``pinion.teeth``, quoted or not, becomes an axis over the rig."""
        if not isinstance(data, Mapping) or "rig" in data:
            return data
        flat = dict(_flat(data))
        rig = {key: value for key, value in flat.items() if "." in key}
        return {key: value for key, value in flat.items() if "." not in key} | ({"rig": rig} if rig else {})

    @model_validator(mode="after")
    def _pattern_alone(self) -> "Grid":
        if self.pattern and self.model_fields_set & set(DAMAGE_AXES):
            beside = sorted(self.model_fields_set & set(DAMAGE_AXES))
            raise ValueError(f"pattern and {beside[0]} are given together; a pattern says all of its teeth's damage")
        return self

    @model_validator(mode="after")
    def _some_teeth(self) -> "Grid":
        if not self.tooth:
            raise ValueError("tooth = [] names no tooth; name some, or 'all'")
        return self

    @model_validator(mode="after")
    def _within_bounds(self) -> "Grid":
        for axis in (*DAMAGE_AXES, *MEASUREMENT_AXES):
            for value in getattr(self, axis):
                check_bounds(axis, value)
        return self

    @model_serializer(mode="wrap")
    def _as_used(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return without_defaults(self, handler(self), FLAW_FIELDS)

    @property
    def listed_damage(self) -> tuple[str, ...]:
        """Axes of damage that list something else than their default."""
        return tuple(axis for axis in DAMAGE_AXES if getattr(self, axis) != type(self).model_fields[axis].default)


class Design(Section):
    """What a sweep simulates."""

    rig: str = Field(description="Name of a built-in rig, or the path of a rig file from the recipe's folder.")
    gear: str | None = Field(default=None, description="The damaged gear; the first mesh's driving gear if left out.")
    seed: int = quantity("-", "Seed of specimens and noise.", ge=0, default=0)
    specimens: int = quantity("-", "Pairs of gears, each with its own index errors.", ge=1, default=1)
    draws: int = quantity("-", "Noise draws of each case and specimen.", ge=1, default=1)
    healthy: int = quantity(
        "-", "Undamaged rows of each specimen at each combination of rig and measurement values.", ge=0, default=0
    )
    grid: Annotated[tuple[Grid, ...], Strict(False)] = quantity("-", "Grids; the sweep is their union.", min_length=1)
    patterns: dict[str, Annotated[tuple[ToothDamage, ...], Strict(False)]] = Field(
        default={}, description="Lists of damaged teeth that differ, by name; before a preset of the same name."
    )

    @model_validator(mode="after")
    def _patterns_exist(self) -> "Design":
        for name in self.named_patterns:
            if name not in {*self.patterns, *PRESETS}:
                known = ", ".join(dict.fromkeys((*self.patterns, *PRESETS)))
                raise ValueError(f"pattern {name!r} is not defined; define it under [sweep.patterns] (known: {known})")
        for name, teeth in self.patterns.items():
            if not any(tooth.is_damage for tooth in teeth):
                raise ValueError(f"patterns.{name} damages no tooth; give at least one tooth a loss or a shift")
        return self

    @property
    def named_patterns(self) -> tuple[str, ...]:
        """Names of the patterns that the grids use."""
        return tuple(dict.fromkeys(name for grid in self.grid for name in grid.pattern))
