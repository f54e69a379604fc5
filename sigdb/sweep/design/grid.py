"""Grids of cases, as a recipe declares them: products of axes, samples of ranges, and tables."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    create_model,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo

from sigdb.core import Section, quantity, without_defaults
from sigdb.sweep.design.axes import (
    AXES,
    AXIS_NAMES,
    DAMAGE_AXES,
    MEASUREMENT_AXES,
    MOST_WHOLE,
    Axis,
    Range,
    check_bounds,
    read_range,
    read_teeth,
    split_axes,
)
from sigdb.sweep.design.life import Life, with_life
from sigdb.sweep.design.sampling import Method
from sigdb.sweep.design.tables import read_table
from sigdb.transmission import OPTIONAL_FIELDS


def _as_list(value: object) -> object:
    return value if isinstance(value, list | tuple) else [value]


Values = Annotated[tuple[float, ...], Strict(False), BeforeValidator(_as_list)]
Counts = Annotated[tuple[int, ...], Strict(False), BeforeValidator(_as_list)]
Names = Annotated[tuple[str, ...], Strict(False), BeforeValidator(_as_list)]


def listed_values(axis: Axis, *, optional: bool = False) -> tuple[object, FieldInfo]:
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


def grid_fields(axes: Mapping[str, Axis]) -> dict[str, tuple[object, FieldInfo]]:
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
    """A product of axes: every combination is a case. A single value is an axis of one value.

    Any numeric field of the rig is an axis by its dotted path, for example ``pinion.teeth = [12, 13]``.
    A combination that damages nothing is left out: undamaged rows come from ``healthy``.

    An axis may be a range, ``{ min = 0.05, max = 0.5 }``: all ranges of a grid are sampled together, in ``points``
    joint points by ``method``. Or a ``table`` lists joint points. Joint points are crossed with the axes that are
    listed.
    """

    rig: dict[str, Values] = Field(default={}, description="Axes over the rig, by dotted path.")
    ranges: dict[str, Range] = Field(
        default={}, description="Axes over a range, by name; in a recipe the axis itself is { min = ..., max = ... }."
    )
    points: int | None = quantity("-", "Joint points of all ranges of the grid.", ge=1, default=None)
    method: Method | None = quantity(
        "-", "Method that draws the points of the ranges; latin-hypercube if left out.", default=None
    )
    table: dict[str, tuple[float, ...] | tuple[str, ...]] | None = Field(
        default=None,
        description="Joint points: the path of a CSV or Parquet file from the recipe's folder, or columns.",
    )

    life: Life | None = Field(
        default=None, description="Severities that grow by a law, over lives; the joint points of the grid."
    )

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: object) -> object:
        """Read axes over the rig from dotted paths, ranges from tables with two ends, and a table from its file."""
        if not isinstance(data, Mapping):
            return data
        others = [name for name in cls.model_fields if name not in (*AXIS_NAMES, "rig")]
        keys = split_axes(data, others)
        if keys.get("ranges") and isinstance(keys["ranges"], Mapping):
            keys["ranges"] = {axis: read_range(axis, value) for axis, value in keys["ranges"].items()}
            keys.setdefault("method", "latin-hypercube")
        if "tooth" in keys:
            keys["tooth"] = read_teeth(keys["tooth"])
        keys = with_life(keys)
        if keys.get("table") is not None:
            keys["table"] = read_table(keys["table"])
        return keys

    @model_validator(mode="after")
    def _consistent(self) -> "Grid":
        rules = (self._sample_problems, self._twice, self._pattern_problems, self._tooth_problems, self._out_of_bounds)
        problems = [problem for rule in rules for problem in rule()]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def _sample_problems(self) -> Iterator[str]:
        """Yield problems with the sample and the table."""
        named = ", ".join(self.ranges)
        if self.table is not None and (self.ranges or self.points is not None):
            sample = f"the range of {named}" if self.ranges else "points"
            yield f"table and {sample} are given together; a grid has a table or a sample, not both"
        elif self.ranges and self.points is None:
            yield f"points is missing; say how many joint points the range of {named} has"
        elif not self.ranges and self.points is not None:
            yield f"points = {self.points} but no axis is a range; give one as {{ min = ..., max = ... }}"
        if not self.ranges and self.method is not None:
            yield f"method = {self.method!r} but no axis is a range; give one as {{ min = ..., max = ... }}"
        if "pattern" in self.ranges:
            yield "pattern is a name and has no range; list names"

    def _twice(self) -> Iterator[str]:
        """Yield axes that are given twice."""
        listed = (self.model_fields_set & set(AXIS_NAMES)) | set(self.rig)
        for axis in (axis for axis in self.joint_axes if axis in listed):
            yield f"{axis} is listed and also in the {'table' if self.table else 'sample'}; give it once"

    def _pattern_problems(self) -> Iterator[str]:
        """Yield axes of damage that are given with a pattern, which has all damage of its teeth."""
        if self.pattern or "pattern" in self.joint_axes:
            for axis in DAMAGE_AXES:
                if self._is_set(axis) or axis in self.joint_axes:
                    yield f"pattern and {axis} are given together; a pattern has all damage of its teeth"

    def _tooth_problems(self) -> Iterator[str]:
        """Yield an empty list of teeth."""
        if not self.tooth:
            yield "tooth = [] names no tooth; name some, or 'all'"
        elif self.tooth != "all" and (greatest := max(self.tooth)) > MOST_WHOLE:
            yield f"tooth = {greatest:.10g} must be at most {MOST_WHOLE}"

    def _out_of_bounds(self) -> Iterator[str]:
        """Yield values that their axes do not take, and empty axes."""
        for axis in (*DAMAGE_AXES, *MEASUREMENT_AXES):
            for value in getattr(self, axis):
                try:
                    check_bounds(axis, value)
                except ValueError as error:
                    yield str(error)
        for axis, values in self.rig.items():
            if not values:
                yield f"{axis} is empty; give at least 1"

    @model_serializer(mode="wrap")
    def _as_used(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        dumped = without_defaults(
            self, handler(self), (*OPTIONAL_FIELDS, "ranges", "points", "method", "table", "life")
        )
        return {name: value for name, value in dumped.items() if name not in self.joint_axes}

    def _is_set(self, axis: str) -> bool:
        return bool(getattr(self, axis) != type(self).model_fields[axis].default)

    @property
    def joint_points(self) -> int:
        """Number of joint points of the sample or the table; 1 for a product alone."""
        return self.points or len(next(iter((self.table or {"": ("",)}).values())))

    @property
    def joint_axes(self) -> tuple[str, ...]:
        """Axes of the sample or the table."""
        return tuple(self.ranges) or tuple(self.table or ())

    @property
    def listed_damage(self) -> tuple[str, ...]:
        """Axes of damage that list something else than their default."""
        return tuple(axis for axis in DAMAGE_AXES if self._is_set(axis))

    @property
    def patterns(self) -> tuple[str, ...]:
        """Names of the patterns of the grid."""
        return tuple(dict.fromkeys((*self.pattern, *map(str, (self.table or {}).get("pattern", ())))))
