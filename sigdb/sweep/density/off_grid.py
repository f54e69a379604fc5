"""Designs of random cases that lie between those of a plan."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal

from sigdb.core import InputError, validated
from sigdb.sweep.design.axes import AXIS_NAMES, DAMAGE_AXES, LIFE_AXES, MEASUREMENT_AXES, WHOLE_AXES, Range
from sigdb.sweep.design.grid import Grid
from sigdb.sweep.design.settings import SweepSettings
from sigdb.sweep.plan.plan import Plan
from sigdb.sweep.plan.rig_points import is_whole

Spans = dict[str, tuple[float, float]]
"""Least and greatest value of axes, by name."""
AxisValues = Range | Sequence[float] | Sequence[str]


def off_grid(base: Plan, *, cases: int, seed: int, specimens: int) -> SweepSettings:
    """Return a design of about ``cases`` random cases between those of a plan.

    Numbers that are not whole (sizes of damage, operating points, other parameters of the rig) are drawn evenly between
    the least and the greatest value in a grid. So are measurements that a grid samples or takes from a table. Whole
    numbers and listed measurements stay as they are. The damage is at tooth 1 where other teeth are turns of it. Grids
    of patterns, and grids with a single value on every axis, are left out.

    Raises
    ------
    InputError
        If no grid has anything between its cases.
    """
    every = [(grid, _spans(base, grid)) for grid in base.design.grid if not grid.patterns]
    spread = [(grid, spans) for grid, spans in every if any(low < high for low, high in spans.values())]
    if not spread:
        raise InputError(
            "nothing lies between the cases: no grid has an axis with several values that are not whole numbers or "
            "names of patterns"
        )
    grids = [_random(base, grid, spans, math.ceil(cases / len(spread))) for grid, spans in spread]
    alike = all(axis in DAMAGE_AXES for grid in grids for axis in grid["ranges"])
    return validated(
        SweepSettings,
        {
            "rig": base.design.rig,
            "gear": base.gear,
            "seed": seed,
            "specimens": specimens,
            # Where the rig or the measurement is drawn too, each case has undamaged rows of its own.
            "healthy": max(1, cases // specimens) if alike else 1,
            "grid": grids,
            "ensemble": base.design.ensemble,
        },
        owner="off-grid design",
    )


def whole_axes(base: Plan, axes: Iterable[str]) -> frozenset[str]:
    """Return the axes, of some, whose values are whole numbers."""
    return frozenset(
        axis for axis in axes if axis in WHOLE_AXES or (axis not in AXIS_NAMES and is_whole(base.rig, axis))
    )


def _axes(base: Plan, grid: Grid) -> dict[str, AxisValues]:
    """Return the values or the range of each axis of a grid, except teeth, lives and listed measurements."""
    swept = {base.rig.path(axis): axis for axis in base.rig_points.swept}
    axes = {axis: getattr(grid, axis) for axis in grid.listed_damage} | grid.rig | grid.ranges | (grid.table or {})
    # One parameter of the rig may be written in several ways: the plan's is that of its columns.
    return {
        axis if axis in AXIS_NAMES else swept[base.rig.path(axis)]: some
        for axis, some in axes.items()
        if axis not in ("tooth", *LIFE_AXES)
    }


def _ends(values: AxisValues) -> tuple[float, float]:
    if isinstance(values, Range):
        return values.min, values.max
    return float(min(values)), float(max(values))


def _wholes(values: AxisValues) -> list[int]:
    """Return whole numbers in order, each once; all numbers of a range."""
    if isinstance(values, Range):
        return list(range(int(values.min), int(values.max) + 1))
    return sorted({int(value) for value in values})


def _spans(base: Plan, grid: Grid) -> Spans:
    """Return the ends of each axis of numbers that are not whole, measurements excepted."""
    axes = _axes(base, grid)
    aside = {*whole_axes(base, axes), *MEASUREMENT_AXES}
    return {axis: _ends(values) for axis, values in axes.items() if axis not in aside}


def _random(base: Plan, grid: Grid, spans: Spans, cases: int) -> dict[str, Any]:
    """Return a grid of random points within the spans, crossed with the whole numbers of a grid."""
    axes, teeth = _axes(base, grid), _teeth(base, grid)
    drawn = spans | {axis: _ends(axes[axis]) for axis in MEASUREMENT_AXES if axis in axes}
    whole = {axis: _wholes(axes[axis]) for axis in sorted(whole_axes(base, axes)) if axis not in drawn}
    of_gear = base.rig.gears[base.gear].teeth if teeth == "all" else len(teeth)
    several = math.prod(map(len, whole.values())) * of_gear
    unnamed = {axis: [base.rig.value(axis)] for axis in base.rig_points.swept if axis not in axes}
    return {
        **unnamed,
        **whole,
        **{axis: getattr(grid, axis) for axis in MEASUREMENT_AXES if getattr(grid, axis)},
        **{axis: [low] for axis, (low, high) in drawn.items() if low == high},
        "tooth": teeth,
        "ranges": {axis: {"min": low, "max": high} for axis, (low, high) in drawn.items() if low < high},
        "points": max(1, cases // several),
        "method": "random",
    }


def _teeth(base: Plan, grid: Grid) -> Literal["all"] | Sequence[int]:
    if base.rig.turns_exactly(base.gear):
        return [1]
    joint = grid.ranges.get("tooth") or (grid.table or {}).get("tooth")
    return _wholes(joint) if joint else grid.tooth
