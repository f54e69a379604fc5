"""The axes of a grid: their names, their bounds, and what one may be instead of a list: a range."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pydantic import field_validator, model_validator

from sigdb.core import InputError, Section, quantity, suggestion
from sigdb.measurement import MeasurementSettings
from sigdb.transmission import FLAW_FIELDS, ToothDamage

DAMAGE_AXES = ("damaged_teeth", "phase_shift_deg", "stiffness_loss", "loss_extent", "friction", *FLAW_FIELDS)
MEASUREMENT_AXES = ("averages", "snr_db", "index_error")
OWN_AXES = ("tooth", *DAMAGE_AXES, "pattern", *MEASUREMENT_AXES)
"""All axes but those over the rig."""
WHOLE_AXES = ("tooth", "damaged_teeth", "pits", "averages")
"""Axes of whole numbers."""


class Range(Section):
    """Values between two ends, from which a sample takes as many as the grid has points."""

    min: float = quantity("-", "Lower end, in the unit of the axis.")
    max: float = quantity("-", "Upper end, in the unit of the axis; for whole numbers it is one of them.")

    @field_validator("min", "max", mode="after")
    @classmethod
    def _positive_zero(cls, value: float) -> float:
        return value + 0.0

    @model_validator(mode="after")
    def _ordered(self) -> "Range":
        if self.min > self.max:
            raise ValueError(f"min = {self.min:g} is more than max = {self.max:g}; exchange them")
        return self


def is_range(value: Any) -> bool:
    """Whether a value of an axis is meant as a range."""
    return isinstance(value, Range) or (isinstance(value, Mapping) and bool(value) and not {*value} - {"min", "max"})


def read_range(axis: str, value: Any) -> Range:
    """A range as written, checked.

    Raises
    ------
    ValueError
        Names the axis, the end, the value and what to do.
    """
    ends = value.model_dump() if isinstance(value, Range) else dict(value)
    for end in ("min", "max"):
        if end not in ends:
            raise ValueError(f"{axis}.{end} is missing; a range has both ends: {{ min = ..., max = ... }}")
        ends[end] = _number(f"{axis}.{end}", ends[end])
        check_bounds(axis, ends[end], of=f"{axis}.{end}")
    if ends["min"] > ends["max"]:
        raise ValueError(f"{axis}.min = {ends['min']:g} is more than {axis}.max = {ends['max']:g}; exchange them")
    return Range(**ends)


def check_bounds(axis: str, value: float, *, of: str | None = None) -> None:
    """Refuse a value that the field behind an axis does not take.

    Raises
    ------
    ValueError
        Names the axis, the rule and the value.
    """
    of = of or axis
    if axis in WHOLE_AXES and value != int(value):
        raise ValueError(f"{of} = {value:g} must be a whole number")
    if axis in ("tooth", "damaged_teeth") and value < 1:
        told = "undamaged rows come from healthy" if axis == "damaged_teeth" else "teeth are numbered from 1"
        raise ValueError(f"{of} = {value:g} must be 1 or more; {told}")
    section: Any = ToothDamage if axis in ToothDamage.model_fields else MeasurementSettings
    if axis in section.model_fields:
        try:
            section(**{axis: int(value) if axis in WHOLE_AXES else value})
        except InputError as error:
            raise ValueError(str(error).replace(f"{section.__name__}: {axis}", of, 1)) from None


def flattened(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Keys and values of nested tables, by dotted path; a range is a value."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not is_range(value):
            yield from flattened(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def split_axes(data: Mapping[str, Any], others: Iterable[str]) -> dict[str, Any]:
    """A grid's keys as written, with its ranges under ``ranges`` and its other axes over the rig under ``rig``.

    Raises
    ------
    ValueError
        If a table stands where an axis of the grid's own has its values.
    """
    found: dict[str, Any] = {}
    rig: dict[str, Any] = {}
    ranges: dict[str, Any] = {}
    for key, value in data.items():
        if key in others:
            found[key] = value
        elif key in OWN_AXES and isinstance(value, Mapping) and not is_range(value):
            raise ValueError(f"{key} = {dict(value)} is no range; give a list, or {{ min = ..., max = ... }}")
        elif key == "rig" and isinstance(value, Mapping):
            rig |= dict(flattened(value))
        elif isinstance(value, Mapping) and not is_range(value):
            rig |= dict(flattened({key: value}))
        elif "." in key:
            rig[key] = value
        elif is_range(value) and key in OWN_AXES:
            ranges[key] = value
        else:
            found[key] = value
    ranges |= {axis: value for axis, value in rig.items() if is_range(value)}
    listed = {axis: value for axis, value in rig.items() if not is_range(value)}
    if ranges:
        found["ranges"] = {**found.get("ranges", {}), **ranges}
    return found | ({"rig": listed} if listed else {})


def _number(of: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{of} = {value!r} must be a number")
    if not math.isfinite(value):
        raise ValueError(f"{of} = {value!r} must be a finite number")
    return float(value)


def read_teeth(value: Any) -> Any:
    """First damaged teeth as written.

    Raises
    ------
    ValueError
        If they are neither whole numbers nor ``all``.
    """
    teeth = value if isinstance(value, list | tuple) else (value,)
    if value != "all" and not all(isinstance(one, int) and not isinstance(one, bool) for one in teeth):
        raise ValueError(f"tooth = {value!r} must be a whole number, a list of them, or 'all'")
    return value if value == "all" else tuple(teeth)


def known_axis(axis: str) -> None:
    """Refuse a name that is neither an axis of a grid nor a dotted path.

    Raises
    ------
    ValueError
        Names the nearest one.
    """
    if axis not in OWN_AXES and "." not in axis:
        raise ValueError(
            f"no axis is called {axis!r}{suggestion(axis, OWN_AXES)} (a number of the rig is named by its dotted path)"
        )
