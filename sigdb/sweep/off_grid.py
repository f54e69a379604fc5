"""Designs of cases that lie between those of a design."""

import math
from typing import Any

import numpy as np

from sigdb.core.errors import InputError
from sigdb.core.fields import validated
from sigdb.sweep.axes import DAMAGE_AXES, MEASUREMENT_AXES, OWN_AXES, WHOLE_AXES
from sigdb.sweep.design import Design, Grid
from sigdb.sweep.rig_points import is_whole
from sigdb.transmission import Transmission


def off_grid(design: Design, rig: Transmission, *, cases: int, seed: int, specimens: int) -> Design:
    """A design of about that many random cases between those of another, with damage at tooth 1.

    Numbers that are not whole (sizes of damage, operating points, other parameters of the rig) are drawn evenly between
    the least and the greatest value that a grid names; whole numbers and measurements stay as they are listed. Grids of
    patterns, and of a single value on every axis, have nothing between.

    Raises
    ------
    InputError
        If no grid has anything between its cases.
    """
    spread = [(grid, _spans(grid, rig)) for grid in design.grid if not grid.patterns]
    spread = [(grid, spans) for grid, spans in spread if any(low < high for low, high in spans.values())]
    if not spread:
        raise InputError("no grid has a number with several values, so nothing lies between its cases")
    grids = [_random(grid, spans, rig, math.ceil(cases / len(spread))) for grid, spans in spread]
    over_rig = any(axis not in OWN_AXES for grid in grids for axis in grid["ranges"])
    return validated(
        Design,
        {
            "rig": design.rig,
            "gear": design.gear,
            "seed": seed,
            "specimens": specimens,
            "healthy": 1 if over_rig else max(1, cases // specimens),
            "grid": grids,
        },
        owner="off-grid design",
    )


def _spans(grid: Grid, rig: Transmission) -> dict[str, tuple[float, float]]:
    """Least and greatest value of each axis of numbers that are not whole, measurements aside."""
    listed = {axis: getattr(grid, axis) for axis in grid.listed_damage} | grid.rig
    ranges = {axis: (one.min, one.max) for axis, one in grid.ranges.items()}
    values: dict[str, Any] = listed | ranges | (grid.table or {})
    return {
        axis: (float(np.min(some)), float(np.max(some)))
        for axis, some in values.items()
        if axis not in (*WHOLE_AXES, *MEASUREMENT_AXES) and (axis in DAMAGE_AXES or not is_whole(rig, axis))
    }


def _random(grid: Grid, spans: dict[str, tuple[float, float]], rig: Transmission, cases: int) -> dict[str, Any]:
    """A grid of random points within the spans, crossed with the whole numbers and measurements of another grid."""
    whole = {axis: values for axis, values in grid.rig.items() if is_whole(rig, axis)}
    whole |= {axis: getattr(grid, axis) for axis in grid.listed_damage if axis in WHOLE_AXES}
    joint = {axis: np.unique(values) for axis, values in (grid.table or {}).items()}
    joint |= {axis: np.arange(one.min, one.max + 1) for axis, one in grid.ranges.items()}
    whole |= {
        axis: values.astype(int).tolist()
        for axis, values in joint.items()
        if axis != "tooth" and axis not in spans and axis not in MEASUREMENT_AXES
    }
    several = math.prod(len(set(values)) for values in whole.values())
    return {
        **whole,
        **{axis: getattr(grid, axis) for axis in MEASUREMENT_AXES if getattr(grid, axis)},
        **{axis: [low] for axis, (low, high) in spans.items() if low == high},
        "tooth": [1],
        "ranges": {axis: {"min": low, "max": high} for axis, (low, high) in spans.items() if low < high},
        "points": max(1, cases // several),
        "method": "random",
    }
