"""Named orders of a gear's shaft, its mesh and the rest of its rig, and the tooth cycle."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction

from sigdb.core import InputError
from sigdb.measurement import tooth_cycle
from sigdb.transmission import Transmission

MESH_HARMONICS = 4
_SHAFT_HARMONICS = 2, 10
"""Harmonics that are named: of the other shafts, and of the averaged shaft."""
_BEARING_HARMONICS = 3
"""Harmonics that are named of each fault of a bearing."""
_SIDEBANDS = 2
"""Pairs of sidebands that are named about each mesh harmonic, for each of its shafts."""
_SAME = 1e-6
"""Difference below which two orders are equal."""


@dataclass(frozen=True, kw_only=True)
class NamedOrder:
    """An order and the part of the rig that causes it.

    Attributes
    ----------
    name
        Name in words.
    kind
        ``shaft``, ``mesh``, ``sideband``, ``bearing``, or ``unnamed`` for a line that no part explains.
    order
        Cycles per revolution of the averaged shaft.
    """

    name: str
    kind: str
    order: float


@dataclass(frozen=True, kw_only=True)
class AveragedGear:
    """The gear over whose revolution the recording is averaged.

    Attributes
    ----------
    name
        In the rig; None without one.
    shaft
        Its shaft's name; None without a rig.
    teeth
        Tooth count.
    cycle
        Revolutions after which the same teeth meet again and all meshes of the rig repeat; None without a rig.
    speed_rpm
        Speed of its shaft at the rig's operating point; None without a rig.
    others
        Tooth counts of the other gears on its shaft.
    mates
        Orders of the shafts of the gears that it meshes with.
    bearings
        Orders at which faults of rolling bearings repeat, with harmonics; empty without rolling elements in the rig.
    orders
        Named orders in increasing order, without repetitions.
    """

    name: str | None
    shaft: str | None
    teeth: int
    cycle: int | None
    speed_rpm: float | None
    others: tuple[int, ...] = ()
    mates: tuple[float, ...] = ()
    bearings: tuple[NamedOrder, ...] = ()
    orders: tuple[NamedOrder, ...]


def averaged_gear(teeth: int | None, rig: Transmission | None = None, gear: str | None = None) -> AveragedGear:
    """Return the averaged gear, from its tooth count or from its rig.

    Parameters
    ----------
    teeth
        Tooth count; not needed with a rig whose gear is named.
    rig
        The rig.
    gear
        Name of its gear. It may be left out where a single gear has that many teeth; without a tooth count too, the
        driving gear of a rig with one mesh is taken.

    Raises
    ------
    InputError
        If tooth count or gear is missing, unknown or ambiguous, or if they contradict each other.
    """
    if rig is None:
        if gear is not None:
            raise InputError(f"gear {gear!r} is a name in a rig, and no rig is given; give the rig, or teeth alone")
        if teeth is None:
            raise InputError("teeth is missing: the tooth count of the gear on the averaged shaft; give it, or a rig")
        return _without_rig(teeth)
    name = gear or _only_gear(rig, teeth)
    rig.meshes_of(name)  # refuses an unknown gear
    here = rig.gears[name]
    if teeth not in (None, here.teeth):
        raise InputError(f"rig {rig.name!r}: gear {name!r} has {here.teeth} teeth, not {teeth}; leave teeth out")
    return AveragedGear(
        name=name,
        shaft=here.shaft,
        teeth=here.teeth,
        cycle=_cycle(rig, name),
        speed_rpm=abs(rig.ratio(here.shaft)) * rig.operating.speed_rpm or None,
        others=tuple(gear.teeth for key, gear in rig.gears.items() if gear.shaft == here.shaft and key != name),
        mates=tuple(abs(rig.ratio(rig.gears[mate].shaft) / rig.ratio(here.shaft)) for mate in _mates(rig, name)),
        bearings=tuple(_bearings(rig, here.shaft)),
        orders=_distinct(_of_rig(rig, here.shaft)),
    )


def _without_rig(teeth: int) -> AveragedGear:
    return AveragedGear(
        name=None,
        shaft=None,
        teeth=teeth,
        cycle=None,
        speed_rpm=None,
        orders=_distinct([*_shaft("shaft", 1.0, _SHAFT_HARMONICS[1]), *_mesh("mesh", teeth, {"shaft": 1.0})]),
    )


def _only_gear(rig: Transmission, teeth: int | None) -> str:
    fitting = [name for name, gear in rig.gears.items() if teeth in (None, gear.teeth)]
    if teeth is None and len(rig.meshes) == 1:
        fitting = [mesh.driving for mesh in rig.meshes.values()]
    if len(fitting) != 1:
        listed = ", ".join(f"{name} ({gear.teeth} teeth)" for name, gear in rig.gears.items()) or "none"
        condition = "" if teeth is None else f" with {teeth} teeth"
        raise InputError(
            f"rig {rig.name!r} has {len(fitting)} gears{condition}; name the gear whose shaft is averaged: {listed}"
        )
    return fitting[0]


def _mates(rig: Transmission, gear: str) -> list[str]:
    """Return the gears that a gear meshes with."""
    return [
        other
        for mesh in rig.meshes_of(gear)
        for other in (rig.meshes[mesh].driving, rig.meshes[mesh].driven)
        if other != gear
    ]


def _cycle(rig: Transmission, gear: str) -> int:
    """Return the revolutions after which the same teeth meet again and each mesh is at the same phase."""
    shaft = rig.gears[gear].shaft
    meet = [tooth_cycle(rig.gears[gear].teeth, rig.gears[mate].teeth) for mate in _mates(rig, gear)]
    repeat = [Fraction(_mesh_order(rig, mesh, shaft)).limit_denominator(10**6).denominator for mesh in rig.meshes]
    return math.lcm(*meet, *repeat)


def _bearings(rig: Transmission, shaft: str) -> Iterator[NamedOrder]:
    for name, bearing in rig.bearings.items():
        turns = abs(rig.ratio(bearing.shaft) / rig.ratio(shaft))
        for fault, order in bearing.rolling.orders.items() if bearing.rolling else ():
            for h in range(1, _BEARING_HARMONICS + 1):
                times = "" if h == 1 else f" x{h}"
                yield NamedOrder(name=f"bearing {name} {fault}{times}", kind="bearing", order=h * order * turns)


def _of_rig(rig: Transmission, shaft: str) -> Iterator[NamedOrder]:
    turns = {name: abs(rig.ratio(name) / rig.ratio(shaft)) for name in rig.shafts}
    for name, order in turns.items():
        if order:
            yield from _shaft(f"shaft {name}", order, _SHAFT_HARMONICS[name == shaft])
    for name, mesh in rig.meshes.items():
        shafts = {rig.gears[gear].shaft: turns[rig.gears[gear].shaft] for gear in (mesh.driving, mesh.driven)}
        yield from _mesh(f"mesh {name}", _mesh_order(rig, name, shaft), shafts)


def _mesh_order(rig: Transmission, mesh: str, shaft: str) -> float:
    driving = rig.gears[rig.meshes[mesh].driving]
    return driving.teeth * abs(rig.ratio(driving.shaft) / rig.ratio(shaft))


def _shaft(name: str, order: float, harmonics: int) -> Iterator[NamedOrder]:
    for h in range(1, harmonics + 1):
        yield NamedOrder(name=name if h == 1 else f"{name} x{h}", kind="shaft", order=h * order)


def _mesh(name: str, order: float, shafts: dict[str, float]) -> Iterator[NamedOrder]:
    for h in range(1, MESH_HARMONICS + 1):
        harmonic = name if h == 1 else f"{name} x{h}"
        yield NamedOrder(name=harmonic, kind="mesh", order=h * order)
        for shaft, turns in shafts.items():
            for k in (*range(-_SIDEBANDS, 0), *range(1, _SIDEBANDS + 1)):
                times = "" if abs(k) == 1 else f"{abs(k)} "
                sign = "+" if k > 0 else "-"
                sideband = f"{harmonic} {sign} {times}{shaft}"
                yield NamedOrder(name=sideband, kind="sideband", order=h * order + k * turns)


_RANK = {"mesh": 0, "shaft": 1, "sideband": 2}


def _distinct(orders: Iterable[NamedOrder]) -> tuple[NamedOrder, ...]:
    """Return increasing orders above 0; where orders coincide, a mesh wins over a shaft, a shaft over a sideband."""
    kept: list[NamedOrder] = []
    for named in sorted(orders, key=lambda named: (_RANK[named.kind], named.order)):
        if named.order > _SAME and all(abs(named.order - other.order) > _SAME for other in kept):
            kept.append(named)
    return tuple(sorted(kept, key=lambda named: named.order))
