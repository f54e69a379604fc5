"""The section ``[sweep]`` of a recipe: which cases are simulated, as a union of grids."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    create_model,
    field_validator,
    model_serializer,
    model_validator,
)

from sigdb.core import Section, quantity, suggestion, without_defaults
from sigdb.dynamics import DEFAULT_SOLVER, SOLVERS
from sigdb.sweep.design.axes import (
    AXES,
    AXIS_NAMES,
    DAMAGE_AXES,
    MEASUREMENT_AXES,
    Axis,
    Range,
    check_bounds,
    read_range,
    read_teeth,
    split_axes,
)
from sigdb.sweep.design.sampling import Method
from sigdb.sweep.design.tables import read_table
from sigdb.transmission import FLAW_FIELDS, PRESETS, ToothDamage


def _as_list(value: Any) -> Any:
    return value if isinstance(value, list | tuple) else [value]


Values = Annotated[tuple[float, ...], Strict(False), BeforeValidator(_as_list)]
Counts = Annotated[tuple[int, ...], Strict(False), BeforeValidator(_as_list)]
Names = Annotated[tuple[str, ...], Strict(False), BeforeValidator(_as_list)]


def listed_values(axis: Axis, *, optional: bool = False) -> Any:
    """Return the type and the field of a list of an axis' values, as :func:`pydantic.create_model` takes them.

    Parameters
    ----------
    axis
        The axis, whose field gives unit and help.
    optional
        Whether the list may be empty, and is by default: the section ``[measurement]`` has the value then. Otherwise
        the default of the field is the only value.
    """
    kind = Counts if axis.is_whole else Values
    if optional:
        return kind, quantity(axis.unit, f"{axis.help} [measurement] if left out.", default=())
    return kind, quantity(axis.unit, axis.help, default=(axis.field.default,), min_length=1)


def grid_fields(axes: Mapping[str, Axis]) -> dict[str, Any]:
    """Return the fields of a grid's axes, in order, as :func:`pydantic.create_model` takes them."""
    tooth = quantity("-", "First damaged tooth: a list, or 'all' teeth of the gear.", default="all")
    pattern = quantity(
        "-",
        "Names of patterns, in place of the axes of damage: those of [sweep.patterns], else pitted, broken, worn.",
        default=(),
    )
    damage = {name: listed_values(axis) for name, axis in axes.items() if name not in ("tooth", *MEASUREMENT_AXES)}
    measurement = {name: listed_values(axes[name], optional=True) for name in MEASUREMENT_AXES}
    return {"tooth": (Literal["all"] | Counts, tooth), **damage, "pattern": (Names, pattern), **measurement}


class Grid(create_model("GridAxes", __base__=Section, **grid_fields(AXES))):  # type: ignore[misc]
    """A product of axes: every combination is a case. A single value is an axis of one point.

    Any numeric field of the rig is an axis by its dotted path, for example ``pinion.teeth = [12, 13]``.
    A combination that damages nothing is left out: undamaged rows come from ``healthy``.

    An axis may be a range, ``{ min = 0.05, max = 0.5 }``: all ranges of a grid are sampled together, in ``points``
    joint points by ``method``. Or a ``table`` lists joint points. Joint points are crossed with the axes that are
    listed.
    """

    rig: dict[str, Values] = Field(default={}, description="Axes over the rig, by dotted path.")
    ranges: dict[str, Range] = Field(
        default={}, description="Axes over a range, by name; written in the axis' place as { min = ..., max = ... }."
    )
    points: int | None = quantity("-", "Joint points of all ranges of the grid.", ge=1, default=None)
    method: Method | None = quantity(
        "-", "How the points of the ranges are chosen; latin-hypercube if left out.", default=None
    )
    table: dict[str, tuple[float, ...] | tuple[str, ...]] | None = Field(
        default=None,
        description="Joint points one by one: the path of a CSV or Parquet file from the recipe's folder, or columns.",
    )

    @model_validator(mode="before")
    @classmethod
    def _as_written(cls, data: Any) -> Any:
        """Dotted paths become axes over the rig, tables with two ends ranges, and a table's path its columns."""
        if not isinstance(data, Mapping):
            return data
        others = [name for name in cls.model_fields if name not in (*AXIS_NAMES, "rig")]
        found = split_axes(data, others)
        if found.get("ranges") and isinstance(found["ranges"], Mapping):
            found["ranges"] = {axis: read_range(axis, value) for axis, value in found["ranges"].items()}
            found.setdefault("method", "latin-hypercube")
        if "tooth" in found:
            found["tooth"] = read_teeth(found["tooth"])
        if found.get("table") is not None:
            found["table"] = read_table(found["table"])
        return found

    @model_validator(mode="after")
    def _sampled(self) -> "Grid":
        named = ", ".join(self.ranges)
        if self.table is not None and (self.ranges or self.points is not None):
            beside = f"the range of {named}" if self.ranges else "points"
            raise ValueError(f"table and {beside} are given together; a grid has a table or a sample, not both")
        if self.ranges and self.points is None:
            raise ValueError(f"points is missing; say how many joint points the range of {named} has")
        if not self.ranges and self.points is not None:
            raise ValueError(f"points = {self.points} but no axis is a range; give one as {{ min = ..., max = ... }}")
        if not self.ranges and self.method is not None:
            raise ValueError(f"method = {self.method!r} but no axis is a range; give one as {{ min = ..., max = ... }}")
        if "pattern" in self.ranges:
            raise ValueError("pattern is a name and has no range; list names")
        return self

    @model_validator(mode="after")
    def _named_once(self) -> "Grid":
        listed = (self.model_fields_set & set(AXIS_NAMES)) | set(self.rig)
        for axis in (one for one in self.joint_axes if one in listed):
            raise ValueError(f"{axis} is listed and also in the {'table' if self.table else 'sample'}; give it once")
        return self

    @model_validator(mode="after")
    def _pattern_alone(self) -> "Grid":
        """A pattern says all of its teeth's damage."""
        if self.pattern or "pattern" in self.joint_axes:
            for axis in DAMAGE_AXES:
                if self._is_set(axis) or axis in self.joint_axes:
                    raise ValueError(f"pattern and {axis} are given together; a pattern says all of its teeth's damage")
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
        for axis, values in self.rig.items():
            if not values:
                raise ValueError(f"{axis} is empty; give at least 1")
        return self

    @model_serializer(mode="wrap")
    def _as_used(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        dumped = without_defaults(self, handler(self), (*FLAW_FIELDS, "ranges", "points", "method", "table"))
        return {name: value for name, value in dumped.items() if name not in self.joint_axes}

    def _is_set(self, axis: str) -> bool:
        return bool(getattr(self, axis) != type(self).model_fields[axis].default)

    @property
    def joint_axes(self) -> tuple[str, ...]:
        """Axes that the sample or the table gives."""
        return tuple(self.ranges) or tuple(self.table or ())

    @property
    def listed_damage(self) -> tuple[str, ...]:
        """Axes of damage that list something else than their default."""
        return tuple(axis for axis in DAMAGE_AXES if self._is_set(axis))

    @property
    def patterns(self) -> tuple[str, ...]:
        """Names of the patterns that it uses."""
        return tuple(dict.fromkeys((*self.pattern, *(str(one) for one in (self.table or {}).get("pattern", ())))))


class SweepSettings(Section):
    """What a sweep simulates."""

    rig: str = Field(description="Name of a built-in rig, or the path of a rig file from the recipe's folder.")
    gear: str | None = Field(default=None, description="The damaged gear; the first mesh's driving gear if left out.")
    seed: int = quantity("-", "Seed of samples, specimens and noise.", ge=0, default=0)
    specimens: int = quantity("-", "Pairs of gears, each with its own index errors.", ge=1, default=1)
    draws: int = quantity("-", "Noise draws of each case and specimen.", ge=1, default=1)
    healthy: int = quantity(
        "-", "Undamaged rows of each specimen at each combination of rig and measurement values.", ge=0, default=0
    )
    grid: Annotated[tuple[Grid, ...], Strict(False)] = quantity("-", "Grids; the sweep is their union.", min_length=1)
    patterns: dict[str, Annotated[tuple[ToothDamage, ...], Strict(False)]] = Field(
        default={}, description="Lists of damaged teeth that differ, by name; before a preset of the same name."
    )

    solver: str = Field(
        default=DEFAULT_SOLVER, description=f"How a case is solved: {', '.join(SOLVERS)}; the first if left out."
    )

    @field_validator("solver")
    @classmethod
    def _known_solver(cls, name: str) -> str:
        if name not in SOLVERS:
            raise ValueError(f"solver = {name!r} is not known{suggestion(name, SOLVERS)}")
        return name

    @model_validator(mode="after")
    def _patterns_exist(self) -> "SweepSettings":
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
        return tuple(dict.fromkeys(name for grid in self.grid for name in grid.patterns))
