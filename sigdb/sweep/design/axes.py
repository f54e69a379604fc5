"""The axes of a grid: the fields whose values they list, and ranges in place of a list."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, TypeGuard

from pydantic import ConfigDict, Strict, TypeAdapter, ValidationError, field_validator, model_validator
from pydantic.fields import FieldInfo

from sigdb.core import Section, quantity, suggestion, unit_of
from sigdb.database import MEMBER
from sigdb.measurement import MeasurementSettings
from sigdb.transmission import Damage, ToothDamage

_FINITE = ConfigDict(allow_inf_nan=False)
MOST_WHOLE = 2**31 - 1
"""Greatest whole number of an axis."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """An axis of a grid over the values of a field, which declares unit, bounds and help.

    Attributes
    ----------
    name
        Name of the axis, which is that of the field.
    field
        The field.
    least
        Least value of the axis, where it is more than that of the field.
    reason
        Why a lesser value is refused.
    """

    name: str
    field: FieldInfo
    least: int | None = None
    reason: str = ""

    @property
    def unit(self) -> str:
        """Unit of the field."""
        return unit_of(self.field)

    @property
    def help(self) -> str:
        """Description of the field."""
        return str(self.field.description)

    @property
    def is_whole(self) -> bool:
        """Whether the values are whole numbers."""
        return self.field.annotation is int

    @cached_property
    def _values(self) -> TypeAdapter[float]:
        kind: Any = Annotated[(self.field.annotation, Strict(), *self.field.metadata)]
        return TypeAdapter(kind, config=_FINITE)

    def check(self, value: float, *, label: str | None = None) -> None:
        """Refuse a value that the field does not take.

        Parameters
        ----------
        value
            The value.
        label
            Name of the value in the message; that of the axis if left out.

        Raises
        ------
        ValueError
            Names the axis, the rule and the value.
        """
        label = label or self.name
        if self.is_whole:
            if value != int(value):
                raise ValueError(f"{label} = {value:g} must be a whole number")
            value = int(value)
            if value > MOST_WHOLE:
                raise ValueError(f"{label} = {value:.10g} must be at most {MOST_WHOLE}")
        if self.least is not None and value < self.least:
            raise ValueError(f"{label} = {value:g} must be {self.least} or more; {self.reason}")
        try:
            self._values.validate_python(value)
        except ValidationError as error:
            rule = error.errors()[0]["msg"].removeprefix("Input should be ")
            raise ValueError(f"{label} = {value!r} must be {rule}") from None


def damage_axes(damage: type[ToothDamage]) -> tuple[Axis, ...]:
    """Return an axis for the number of damaged teeth, and for each field of a tooth's damage."""
    teeth = Axis(
        name="damaged_teeth",
        field=Damage.model_fields["damaged_teeth"],
        least=1,
        reason="undamaged rows come from healthy",
    )
    return teeth, *(Axis(name=name, field=field) for name, field in damage.model_fields.items())


_TOOTH = Axis(name="tooth", field=Damage.model_fields["tooth"], least=1, reason="teeth are numbered from 1")
_DAMAGE = damage_axes(ToothDamage)
_MEASUREMENT = tuple(Axis(name=name, field=field) for name, field in MeasurementSettings.model_fields.items())

AXES = {axis.name: axis for axis in (_TOOTH, *_DAMAGE, *_MEASUREMENT)}
"""Axes of numbers, by name, but those over the rig."""
DAMAGE_AXES = tuple(axis.name for axis in _DAMAGE)
MEASUREMENT_AXES = tuple(axis.name for axis in _MEASUREMENT)
WHOLE_AXES = tuple(name for name, axis in AXES.items() if axis.is_whole)
"""Axes of whole numbers."""
LIFE_AXES = ("life_number", "life_time")
"""Columns of the joint points of lives: each look is a row of its own."""
ROW_AXES = (*MEASUREMENT_AXES, *LIFE_AXES)
"""Axes in which rows of the same case differ."""
AXIS_NAMES = ("tooth", *DAMAGE_AXES, "pattern", *MEASUREMENT_AXES)
"""Names of all axes but those over the rig."""


class Range(Section):
    """Values between two ends, from which a sample draws one for each joint point of the grid."""

    min: float = quantity("-", "Lower end, in the unit of the axis.")
    max: float = quantity("-", "Upper end, in the unit of the axis; an axis of whole numbers takes this value too.")

    @field_validator("min", "max", mode="after")
    @classmethod
    def _positive_zero(cls, value: float) -> float:
        return value + 0.0

    @model_validator(mode="after")
    def _ordered(self) -> "Range":
        if self.min > self.max:
            raise ValueError(f"min = {self.min:g} is more than max = {self.max:g}; exchange them")
        return self


def is_range(value: object) -> TypeGuard[Range | Mapping[str, object]]:
    """Return whether a value of an axis is meant as a range."""
    return isinstance(value, Range) or (isinstance(value, Mapping) and bool(value) and not {*value} - {"min", "max"})


def read_range(axis: str, value: Range | Mapping[str, object]) -> Range:
    """Return a range from what a recipe holds, checked.

    Raises
    ------
    ValueError
        Names the axis, the end, the value and what to do.
    """
    content = value.model_dump() if isinstance(value, Range) else value
    ends: dict[str, float] = {}
    for end in ("min", "max"):
        if end not in content:
            raise ValueError(f"{axis}.{end} is missing; a range has both ends: {{ min = ..., max = ... }}")
        ends[end] = _read_number(f"{axis}.{end}", content[end])
        check_bounds(axis, ends[end], label=f"{axis}.{end}")
    if ends["min"] > ends["max"]:
        raise ValueError(f"{axis}.min = {ends['min']:g} is more than {axis}.max = {ends['max']:g}; exchange them")
    return Range(**ends)


def check_bounds(name: str, value: float, *, label: str | None = None) -> None:
    """Refuse a value that an axis does not take; an axis over the rig is checked when the rig is built.

    Raises
    ------
    ValueError
        Names the axis, the rule and the value.
    """
    if name in AXES:
        AXES[name].check(value, label=label)


def flatten(table: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield keys and values of nested tables, by dotted path; a range is a value."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not is_range(value):
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def split_axes(data: Mapping[str, object], others: Iterable[str]) -> dict[str, object]:
    """Return a grid's keys with its ranges under ``ranges`` and its other axes over the rig under ``rig``.

    Parameters
    ----------
    data
        The keys and values in the recipe.
    others
        Names of the keys that are no axes.

    Raises
    ------
    ValueError
        If a table stands where an axis that is not over the rig has its values.
    """
    keys: dict[str, object] = {}
    rig: dict[str, object] = {}
    ranges: dict[str, object] = {}
    for key, value in data.items():
        if key in others:
            keys[key] = value
        elif key in AXIS_NAMES and isinstance(value, Mapping) and not is_range(value):
            raise ValueError(f"{key} = {dict(value)} is no range; give a list, or {{ min = ..., max = ... }}")
        elif key == "rig" and isinstance(value, Mapping):
            rig |= dict(flatten(value))
        elif isinstance(value, Mapping) and not is_range(value):
            rig |= dict(flatten({key: value}))
        elif "." in key or key == MEMBER:
            rig[key] = value
        elif is_range(value) and key in AXIS_NAMES:
            ranges[key] = value
        else:
            keys[key] = value
    if "member" in rig:  # rig.member, which is a field of the rig
        rig[MEMBER] = rig.pop("member")
    ranges |= {axis: value for axis, value in rig.items() if is_range(value)}
    listed = {axis: value for axis, value in rig.items() if not is_range(value)}
    if ranges:
        declared = keys.get("ranges", {})
        keys["ranges"] = {**declared, **ranges} if isinstance(declared, Mapping) else declared
    return keys | ({"rig": listed} if listed else {})


def _read_number(label: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{label} = {value!r} must be a number")
    if not math.isfinite(value):
        raise ValueError(f"{label} = {value!r} must be a finite number")
    return float(value)


def read_teeth(value: object) -> object:
    """Return first damaged teeth from what a recipe holds.

    Raises
    ------
    ValueError
        If they are neither whole numbers nor ``all``.
    """
    teeth = value if isinstance(value, list | tuple) else (value,)
    if value != "all" and not all(isinstance(tooth, int) and not isinstance(tooth, bool) for tooth in teeth):
        raise ValueError(f"tooth = {value!r} must be a whole number, a list of them, or 'all'")
    return value if value == "all" else tuple(teeth)


def axis_name(name: str) -> str:
    """Return the name of an axis that may begin with ``rig.``; ``rig.member`` is the rig's field ``rig_member``."""
    return MEMBER if name == "rig.member" else name.removeprefix("rig.")


def check_axis_name(name: str) -> None:
    """Refuse a name that is neither an axis of a grid nor a dotted path.

    Raises
    ------
    ValueError
        Names the nearest axis.
    """
    if name not in (*AXIS_NAMES, *LIFE_AXES, MEMBER) and "." not in name:
        raise ValueError(
            f"no axis is called {name!r}{suggestion(name, AXIS_NAMES)} (a number of the rig is named by its dotted "
            "path)"
        )
