"""The joint points of a grid: its sample or its table, as values of the axes that they set."""

import numpy as np

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.sweep.axes import OWN_AXES, WHOLE_AXES, Range
from sigdb.sweep.design import Grid
from sigdb.sweep.rig_points import is_whole
from sigdb.sweep.sampling import grid_sample, in_range, whole_in_range
from sigdb.transmission import Transmission


def joint_points(grid: Grid, rig: Transmission, *, owner: str, number: int, seed: int) -> dict[str, FloatArray]:
    """(points,) values of each axis that a grid's sample or table gives; none for a product alone.

    Averages from a range stay unit coordinates: which are whole tooth cycles depends on the rig's tooth counts.

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
        If a whole number of the rig, as a tooth count, is given a fraction.
    """
    whole = {axis for axis in grid.joint_axes if axis in WHOLE_AXES or (axis not in OWN_AXES and is_whole(rig, axis))}
    if grid.ranges:
        method, points = grid.method or "latin-hypercube", grid.points or 1
        sample = grid_sample(method, points, grid.joint_axes, seed=seed, grid=number)
        return {axis: _placed(axis, u, grid.ranges[axis], axis in whole, owner) for axis, u in sample.items()}
    columns = {axis: np.array(values) for axis, values in (grid.table or {}).items()}
    for axis in whole:
        for row in np.flatnonzero(columns[axis] % 1)[:1]:
            raise InputError(f"{owner}: table row {row + 1}: {axis} = {columns[axis][row]:g} must be a whole number")
    return columns


def _placed(axis: str, u: FloatArray, ends: Range, whole: bool, owner: str) -> FloatArray:
    if axis == "averages":
        return u
    if not whole:
        return in_range(u, ends.min, ends.max)
    for end, value in (("min", ends.min), ("max", ends.max)):
        if value % 1:
            raise InputError(f"{owner}: {axis}.{end} = {value:g} must be a whole number")
    return whole_in_range(u, ends.min, ends.max)
