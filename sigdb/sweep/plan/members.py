"""Members of an ensemble of rigs in a sweep: their draws, and the axis that numbers them."""

from sigdb.core import InputError
from sigdb.database import MEMBER
from sigdb.dynamics import ensemble
from sigdb.sweep.design.settings import SweepSettings
from sigdb.transmission import Transmission


def with_members(design: SweepSettings, rig: Transmission) -> SweepSettings:
    """Return a design whose ensemble has its values, drawn where it has none, and whose grids all name its members.

    Raises
    ------
    InputError
        If a grid names members without an ensemble, or the rig has nothing to draw from.
    """
    if design.ensemble is None:
        for number, grid in enumerate(design.grid, start=1):
            if MEMBER in grid.rig or MEMBER in grid.joint_axes:
                raise InputError(
                    f"sweep.grid.{number}: rig.member names members of an ensemble; give its number of members in "
                    "[sweep.ensemble]"
                )
        return design
    drawn = design.ensemble
    if not drawn.values:
        try:
            values = ensemble(rig, drawn.members, rng=drawn.seed).values
        except InputError as error:
            raise InputError(f"sweep.ensemble: {error}") from None
        drawn = drawn.model_copy(update={"values": tuple(dict(member) for member in values)})
    every = tuple(float(number) for number in range(1, drawn.members + 1))
    grids = tuple(
        grid
        if MEMBER in grid.rig or MEMBER in grid.joint_axes
        else grid.model_copy(update={"rig": {MEMBER: every, **grid.rig}})
        for grid in design.grid
    )
    return design.model_copy(update={"ensemble": drawn, "grid": grids})


def members_of(design: SweepSettings, rig: Transmission) -> tuple[Transmission, ...]:
    """Return the rigs of a design's ensemble, each with its number.

    Raises
    ------
    InputError
        If the values of a member do not fit the rig.
    """
    values = design.ensemble.values if design.ensemble is not None else ()
    members = []
    for number, member in enumerate(values, start=1):
        try:
            members.append(rig.with_assumed(member).replace({MEMBER: number}))
        except InputError as error:
            raise InputError(f"sweep.ensemble.values.{number}: {error}") from None
    return tuple(members)
