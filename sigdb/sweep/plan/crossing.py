"""Cases of a grid: its joint points, from a sample or a table, crossed with the values that its axes list.

A place is a joint point at one combination of the listed values of the rig. Joint points that differ only in their
measurement are the same place, with several measurements.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.measurement import MeasurementSettings
from sigdb.sweep.design.axes import (
    AXIS_NAMES,
    DAMAGE_AXES,
    LIFE_AXES,
    MEASUREMENT_AXES,
    ROW_AXES,
    WHOLE_AXES,
    Range,
)
from sigdb.sweep.design.grid import Grid
from sigdb.sweep.design.sampling import grid_sample, scale_to_range, scale_to_whole
from sigdb.sweep.plan.damages import reset_unused_details
from sigdb.sweep.plan.layout import consecutive, distinct
from sigdb.sweep.plan.rig_points import is_whole
from sigdb.transmission import Transmission

AxisArray = NDArray[Any]
"""Values of an axis: numbers, or names of patterns."""


def combinations(axes: Iterable[Sequence[float] | Sequence[str]]) -> int:
    """Return the number of combinations of distinct values; an empty list counts as one value."""
    return math.prod(len(set(values)) or 1 for values in axes)


def product(axes: Mapping[str, Sequence[float] | Sequence[str]]) -> tuple[dict[str, AxisArray], int]:
    """Return each combination of distinct values as columns, the last axis fastest, and their number."""
    lists = [np.array(list(dict.fromkeys(values))) for values in axes.values()]
    mesh = np.meshgrid(*lists, indexing="ij") if lists else []
    columns = {axis: column.ravel() for axis, column in zip(axes, mesh, strict=True)}
    return columns, int(np.prod([len(values) for values in lists], dtype=int))


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """A grid and its joint points.

    Attributes
    ----------
    owner
        Name of the grid in messages.
    grid
        The grid.
    joint
        (points,) values of each axis that a sample or a table gives; none for a product alone.
    """

    owner: str
    grid: Grid
    joint: Mapping[str, AxisArray]

    @cached_property
    def _joint_groups(self) -> tuple[IntArray, IntArray]:
        """Group number of each joint point, by all but its measurement, and the first point of each group."""
        n = len(next(iter(self.joint.values()))) if self.joint else 1
        return distinct(np.zeros(n), *(self.joint[axis] for axis in self.joint if axis not in ROW_AXES))

    @cached_property
    def _listed_rig(self) -> tuple[dict[str, FloatArray], int]:
        return product({axis: self.grid.rig[axis] for axis in sorted(self.grid.rig)})

    @property
    def places(self) -> int:
        """Number of places."""
        return len(self._joint_groups[1]) * self._listed_rig[1]

    @property
    def cases(self) -> int:
        """Number of cases of damage, including those that damage nothing."""
        listed = ("pattern",) if self.grid.pattern else self.grid.listed_damage
        return self.places * combinations(getattr(self.grid, axis) for axis in listed)

    @property
    def _group(self) -> IntArray:
        """(places,) number of the group of joint points of each place."""
        return np.repeat(np.arange(len(self._joint_groups[1])), self._listed_rig[1])

    @property
    def rig_values(self) -> dict[str, FloatArray]:
        """(places,) values of each swept parameter of the rig."""
        listed, _ = self._listed_rig
        first = self._joint_groups[1][self._group]
        repeats = len(self._joint_groups[1])
        return {axis: np.tile(column, repeats) for axis, column in listed.items()} | {
            axis: np.asarray(column)[first]
            for axis, column in self.joint.items()
            if axis not in (*AXIS_NAMES, *LIFE_AXES)
        }

    def damages(self) -> tuple[dict[str, FloatArray], AxisArray | None, int]:
        """Return the damage of each case as columns, the names of the patterns, and the number of cases in a place.

        Cases stand place by place. Without patterns the names are None. Only axes that are not at their default have a
        column.
        """
        first = self._joint_groups[1][self._group]
        joint = {axis: np.asarray(self.joint[axis])[first] for axis in (*DAMAGE_AXES, "pattern") if axis in self.joint}
        if self.grid.pattern:
            listed, n = product({"pattern": self.grid.pattern})
        elif "pattern" in joint:
            listed, n = {}, 1
        else:
            listed, n = product({axis: getattr(self.grid, axis) for axis in self.grid.listed_damage})
        columns = {axis: np.tile(column, self.places) for axis, column in listed.items()}
        columns |= {axis: np.repeat(column, n) for axis, column in joint.items()}
        names = columns.pop("pattern", None)
        return reset_unused_details(columns), names, n

    def teeth(self, teeth: IntArray) -> tuple[IntArray, IntArray, IntArray]:
        """Return where the teeth of each place begin in a list, their number, both (places,), and the list.

        If the list is empty, the teeth stand in the list of all numbers from 0 on.

        Parameters
        ----------
        teeth
            (places,) tooth count of the damaged gear.

        Raises
        ------
        InputError
            If it names a tooth that the gear does not have.
        """
        none = np.empty(0, np.int64)
        if "tooth" in self.joint:
            named = np.asarray(self.joint["tooth"])[self._joint_groups[1][self._group]].astype(np.int64)
            self._check_teeth(named, teeth)
            return named, np.ones_like(named), none
        if self.grid.tooth == "all":
            return np.ones_like(teeth), teeth, none
        listed = np.array(list(dict.fromkeys(self.grid.tooth)))
        for tooth in listed:
            self._check_teeth(np.full_like(teeth, tooth), teeth)
        count = np.full_like(teeth, len(listed))
        return np.zeros_like(teeth), count, listed

    def _check_teeth(self, named: IntArray, teeth: IntArray) -> None:
        """Refuse teeth that the gear of a place does not have."""
        for at in np.flatnonzero((named < 1) | (named > teeth))[:1]:
            raise InputError(
                f"{self.owner}: tooth = {named[at]} is not on a gear of {teeth[at]} teeth; "
                f"name teeth from 1 to {teeth[at]}, or 'all'"
            )

    def measurements(
        self, default: MeasurementSettings, cycles: IntArray
    ) -> tuple[dict[str, FloatArray], IntArray, IntArray]:
        """Return measurements as columns, and where those of each place begin and their number, both (places,).

        Parameters
        ----------
        default
            Values of axes that the grid does not name.
        cycles
            (places,) revolutions in a tooth cycle.
        """
        listed, n = product({axis: getattr(self.grid, axis) for axis in MEASUREMENT_AXES if getattr(self.grid, axis)})
        columns = {axis: np.full(n, float(getattr(default, axis))) for axis in MEASUREMENT_AXES}
        columns |= {axis: column.astype(float) for axis, column in listed.items()}
        joint = [axis for axis in ROW_AXES if axis in self.joint]
        if not joint:
            return columns, np.zeros(self.places, np.int64), np.full(self.places, n)
        point, place = self._points_of_places()
        columns = {axis: np.tile(column, len(point)) for axis, column in columns.items()}
        for axis in joint:
            values = np.asarray(self.joint[axis], float)[point]
            if axis in self.grid.ranges and axis == "averages":
                values = self._whole_cycles(values, cycles[place])
            columns[axis] = np.repeat(values, n)
        place = np.repeat(place, n)
        _, first = distinct(place, *columns.values())
        count = np.bincount(place[first], minlength=self.places)
        return {axis: column[first] for axis, column in columns.items()}, np.cumsum(count) - count, count

    def _points_of_places(self) -> tuple[IntArray, IntArray]:
        """Return the joint points of the places, place by place, and the place of each."""
        groups, first = self._joint_groups
        sizes = np.bincount(groups, minlength=len(first))
        starts = np.cumsum(sizes) - sizes
        members = np.argsort(groups, kind="stable")
        point = members[consecutive(starts[self._group], sizes[self._group])]
        return point, np.repeat(np.arange(self.places), sizes[self._group])

    def _whole_cycles(self, u: FloatArray, cycles: IntArray) -> FloatArray:
        """Return averages at unit coordinates of the range: whole tooth cycles from end to end, all equally likely."""
        ends = self.grid.ranges["averages"]
        least, most = np.ceil(ends.min / cycles), np.floor(ends.max / cycles)
        for at in np.flatnonzero(most < least)[:1]:
            raise InputError(
                f"{self.owner}: averages from {ends.min:g} to {ends.max:g} hold no whole tooth cycles, which are "
                f"multiples of {cycles[at]} revolutions; use for example {{ min = {cycles[at]}, "
                f"max = {cycles[at] * max(2, round(ends.max / cycles[at]))} }}"
            )
        return scale_to_whole(u, least, most) * cycles


def joint_points(grid: Grid, rig: Transmission, *, owner: str, number: int, seed: int) -> dict[str, FloatArray]:
    """Return the (points,) values of each axis in a grid's sample or table; no axes for a product alone.

    Averages from a range stay unit coordinates, since whole tooth cycles depend on the rig's tooth counts.

    Parameters
    ----------
    grid, rig
        The grid, and the rig that it is for.
    owner, number
        Name of the grid in messages, and its number in the design.
    seed
        The design's seed.

    Raises
    ------
    InputError
        If a parameter of the rig that is a whole number, as a tooth count, has a fraction.
    """
    named = (*AXIS_NAMES, *LIFE_AXES)
    whole = {axis for axis in grid.joint_axes if axis in WHOLE_AXES or (axis not in named and is_whole(rig, axis))}
    if grid.ranges:
        method, points = grid.method or "latin-hypercube", grid.points or 1
        sample = grid_sample(method, points, grid.joint_axes, seed=seed, grid=number)
        return {axis: _values_at(axis, u, grid.ranges[axis], axis in whole, owner) for axis, u in sample.items()}
    columns = {axis: np.array(values) for axis, values in (grid.table or {}).items()}
    for axis in whole:
        for row in np.flatnonzero(columns[axis] % 1)[:1]:
            raise InputError(f"{owner}: table row {row + 1}: {axis} = {columns[axis][row]:g} must be a whole number")
    return columns


def _values_at(axis: str, u: FloatArray, ends: Range, whole: bool, owner: str) -> FloatArray:
    if axis == "averages":
        return u
    if not whole:
        return scale_to_range(u, ends.min, ends.max)
    for end, value in (("min", ends.min), ("max", ends.max)):
        if value % 1:
            raise InputError(f"{owner}: {axis}.{end} = {value:g} must be a whole number")
    return scale_to_whole(u, ends.min, ends.max)


def grid_name(number: int) -> str:
    """Return the name of a grid in messages, where grids count from 1."""
    return f"sweep.grid.{number + 1}"
