"""The rigs of a sweep: the recipe's rig at each combination of swept values, built on first use."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

import numpy as np
from pydantic.fields import FieldInfo

from sigdb.core import FloatArray, InputError, IntArray, Section
from sigdb.database import MEMBER
from sigdb.dynamics import common_period
from sigdb.measurement import tooth_cycle
from sigdb.sweep.plan.layout import distinct
from sigdb.transmission import Transmission

_OPERATING = (("operating", "speed_rpm"), ("operating", "torque"))
"""Paths whose values change no other part of a rig: only their extremes are checked, not every combination."""

FullPath = tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class RigPoint:
    """A rig at one combination of swept values, and the revolutions after which all its meshes repeat."""

    base: Transmission
    values: dict[str, float]
    teeth: int
    mate_teeth: int
    revolutions: int

    @cached_property
    def rig(self) -> Transmission:
        """The rig itself, built on first use."""
        return self.base.replace(self.values)


@dataclass(frozen=True, kw_only=True)
class RigPoints(Sequence[RigPoint]):
    """All rigs of a sweep, distinct, in the order in which the grids name them.

    Attributes
    ----------
    base
        The recipe's rig.
    members
        The members of its ensemble.
    swept
        Dotted paths of the swept parameters, as the first grid writes each.
    values
        (points, swept) their values.
    teeth, mate_teeth, revolutions
        (points,) tooth counts of the damaged gear and its mate, and the common period of all meshes.
    builds
        (points,) number of the build; points of the same build differ only in speed and torque.
    """

    base: Transmission
    members: tuple[Transmission, ...] = ()
    swept: tuple[str, ...]
    values: FloatArray
    teeth: IntArray
    mate_teeth: IntArray
    revolutions: IntArray
    builds: IntArray

    def __len__(self) -> int:
        return len(self.teeth)

    @overload
    def __getitem__(self, number: int) -> RigPoint: ...
    @overload
    def __getitem__(self, number: slice) -> tuple[RigPoint, ...]: ...
    def __getitem__(self, number: int | slice) -> RigPoint | tuple[RigPoint, ...]:
        if isinstance(number, slice):
            return tuple(self[i] for i in range(*number.indices(len(self))))
        values = dict(zip(self.swept, self.values[number].tolist(), strict=True))
        base, changed = _changed(self.base, self.members, values)
        return RigPoint(
            base=base,
            values=changed,
            teeth=int(self.teeth[number]),
            mate_teeth=int(self.mate_teeth[number]),
            revolutions=int(self.revolutions[number]),
        )

    @property
    def cycles(self) -> IntArray:
        """(points,) number of revolutions after which the same teeth meet again and all meshes repeat."""
        pairs, first = distinct(self.teeth, self.mate_teeth, self.revolutions)
        each = [
            math.lcm(tooth_cycle(int(self.teeth[i]), int(self.mate_teeth[i])), int(self.revolutions[i])) for i in first
        ]
        return np.array(each, np.int64)[pairs]

    def parameter(self, dotted: str) -> FloatArray:
        """Return the (points,) values of any numeric parameter of the rig."""
        path = self.base.path(dotted)
        for i, name in enumerate(self.swept):
            if self.base.path(name) == path:
                return self.values[:, i]
        if MEMBER in self.swept and self.members:
            each = np.array([self.base.value(dotted), *(member.value(dotted) for member in self.members)])
            return np.asarray(each[self.values[:, self.swept.index(MEMBER)].astype(int)])
        return np.full(len(self), self.base.value(dotted))


def rig_points(
    rig: Transmission,
    gear: str,
    grids: Sequence[tuple[str, Mapping[str, FloatArray], int]],
    *,
    members: tuple[Transmission, ...] = (),
    most_builds: Callable[[int], None] = lambda builds: None,
) -> tuple[RigPoints, list[IntArray]]:
    """Return the distinct rigs of grids, checked, and the (points,) numbers of the rigs of each grid's points.

    Parameters
    ----------
    rig, gear
        The recipe's rig, and its damaged gear.
    grids
        Name of each grid for messages, (n,) values of the parameters that it sweeps by dotted path, and n.
    members
        The members of the rig's ensemble, which the axis ``rig_member`` numbers from 1.
    most_builds
        Called with the number of rigs that differ in more than speed and torque, before they are built.

    Raises
    ------
    InputError
        If a path names no number of the rig, or a value does not fit it.
    """
    swept: dict[FullPath, str] = {}
    for owner, values, _ in grids:
        _check_named_once(rig, owner, values)
        _check_members(rig, members, owner, values)
        for dotted in values:
            swept.setdefault(rig.path(dotted), dotted)
    columns = [np.concatenate([_column(rig, path, values, n) for _, values, n in grids]) for path in swept]
    total = sum(n for *_, n in grids)
    codes, first = distinct(np.zeros(total), *columns)
    table = np.stack([column[first] for column in columns], axis=1) if columns else np.empty((1, 0))
    counts = _count_teeth(rig, members, gear, swept, table, most_builds)
    points = RigPoints(base=rig, members=members, swept=tuple(swept.values()), values=table, **counts)
    return points, np.split(codes, np.cumsum([n for *_, n in grids])[:-1])


def field_at(rig: Transmission, dotted: str) -> FieldInfo | None:
    """Return the field of the rig at a dotted path, with its unit and help; None inside a vector or a table."""
    here: Any = rig
    *parents, name = rig.path(dotted)
    for part in parents:
        here = getattr(here, part) if isinstance(here, Section) else here[int(part) if part.isdigit() else part]
    return type(here).model_fields.get(name) if isinstance(here, Section) else None


def is_whole(rig: Transmission, dotted: str) -> bool:
    """Return whether a parameter of the rig is a whole number, as a tooth count is."""
    field = field_at(rig, dotted)
    return field is not None and field.annotation is int


def _check_named_once(rig: Transmission, owner: str, values: Mapping[str, FloatArray]) -> None:
    names: dict[FullPath, str] = {}
    for dotted in values:
        other = names.setdefault(rig.path(dotted), dotted)
        if other != dotted:
            raise InputError(f"{owner}: {other} and {dotted} are the same parameter of the rig; name it once")


def _column(rig: Transmission, path: FullPath, values: Mapping[str, FloatArray], n: int) -> FloatArray:
    """Return the (n,) values of a parameter in a grid; that of the rig where the grid does not sweep it."""
    for dotted, column in values.items():
        if rig.path(dotted) == path:
            return np.asarray(column, float) + 0.0
    return np.full(n, rig.value(".".join(path)))


def _check_members(
    rig: Transmission, members: tuple[Transmission, ...], owner: str, values: Mapping[str, FloatArray]
) -> None:
    """Refuse members that the ensemble does not have, and axes over numbers that its members have values of."""
    if MEMBER not in values:
        return
    for number in values[MEMBER]:
        if number % 1 or not 1 <= number <= len(members):
            raise InputError(f"{owner}: rig.member = {number:g} is no member; the ensemble has 1 to {len(members)}")
    assumed = set(rig.assumptions)
    for dotted in values:
        if ".".join(rig.path(dotted)) in assumed:
            raise InputError(
                f"{owner}: {dotted} is swept, and each member of the ensemble has its own; sweep one of the two, or "
                f"remove what the rig assumes of {dotted}"
            )


def _changed(
    rig: Transmission, members: tuple[Transmission, ...], values: dict[str, float]
) -> tuple[Transmission, dict[str, float]]:
    """Return the rig or the member that a point starts from, and the values in which it differs."""
    base = members[int(values[MEMBER]) - 1] if values.get(MEMBER) else rig
    return base, {dotted: value for dotted, value in values.items() if dotted != MEMBER and value != rig.value(dotted)}


def _count_teeth(
    rig: Transmission,
    members: tuple[Transmission, ...],
    gear: str,
    swept: Mapping[FullPath, str],
    table: FloatArray,
    most_builds: Callable[[int], None],
) -> dict[str, IntArray]:
    """Build each rig that differs in more than speed and torque once, and return tooth counts and common periods.

    The extremes of speed and torque are built too, so that a value out of bounds is refused.
    """
    names = list(swept.values())
    apart = [i for i, path in enumerate(swept) if path not in _OPERATING]
    build, first = distinct(np.zeros(len(table)), *(table[:, i] for i in apart))
    most_builds(len(first))
    counts = []
    for at in first:
        base, values = _changed(rig, members, dict(zip(names, table[at].tolist(), strict=True)))
        built = base.replace(values)
        teeth, mate = (built.gears[name].teeth for name in (gear, built.mate(gear)))
        counts.append((teeth, mate, common_period(built, gear)[0]))
    for i, path in enumerate(swept):
        if path in _OPERATING:
            for extreme in (table[:, i].min(), table[:, i].max()):
                rig.replace({names[i]: float(extreme)})
    teeth, mates, revolutions = np.array(counts, np.int64)[build].T
    return {"teeth": teeth, "mate_teeth": mates, "revolutions": revolutions, "builds": build}


def check_whole_cycles(averages: IntArray, rig_measured: tuple[IntArray, IntArray], points: RigPoints) -> None:
    """Refuse averages of rigs, both with their numbers, that are no whole tooth cycles."""
    rig, measured = rig_measured
    cycles = points.cycles[rig]
    for at in np.flatnonzero(averages[measured] % cycles)[:1]:
        value, cycle, point = averages[measured[at]], cycles[at], points[rig[at]]
        raise InputError(
            f"measurement.averages = {value} is not a whole number of tooth cycles: the same teeth of "
            f"{point.teeth} and {point.mate_teeth} meet every {cycle} revolutions; use for example "
            f"{max(1, round(value / cycle)) * cycle}"
        )
