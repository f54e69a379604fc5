"""Layout of a rig's drawing: places and scales of its shafts and of the bodies on them."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray
from sigdb.transmission import Disk, Gear, Transmission

_WIDTH = 7.0
_LEAST_WIDTH = 4.3
_TALLEST, _LEAST_TALL, _LONE = 1.4, 0.7, 1.0
"""Inches: bounds of the greatest radius as drawn, and that radius where shafts have no length."""


@dataclass(frozen=True, kw_only=True)
class DrawnBody:
    """A gear or disk: its node's place, radius and width, m; ``exact`` unless the size stands for given numbers."""

    name: str
    shaft: str
    node: int
    radius: float
    width: float
    gear: bool
    exact: bool


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Shafts in the order of their rows, the place of each node along the drawing, and two scales.

    Attributes
    ----------
    nodes
        (nodes,) by shaft, m from the left.
    axial, radial
        Inches per metre along and across the shafts.
    """

    nodes: dict[str, FloatArray]
    bodies: tuple[DrawnBody, ...]
    axial: float
    radial: float

    def x(self, shaft: str, node: int) -> float:
        """Return the place of a node, inches from the left."""
        return float(self.nodes[shaft][node] * self.axial)


def lay_out(rig: Transmission) -> Layout:
    """Return the layout of a rig: driven shafts below driving ones, parallel ones in line with their gears in mesh."""
    nodes = _aligned(rig)
    bodies = tuple(_bodies(rig))
    length = max(float(np.ptp(np.concatenate(list(nodes.values())))), 0.0)
    radii = [body.radius for body in bodies]
    radii += [segment.outer_diameter / 2 for shaft in rig.shafts.values() for segment in shaft.segments]
    tallest = max(radii, default=0.0) or 1.0
    if not length:
        return Layout(nodes=nodes, bodies=bodies, axial=_LONE / tallest, radial=_LONE / tallest)
    axial = min(_WIDTH / length, max(_TALLEST / tallest, _LEAST_WIDTH / length))
    return Layout(
        nodes=nodes,
        bodies=bodies,
        axial=axial,
        radial=float(np.clip(axial * tallest, _LEAST_TALL, _TALLEST)) / tallest,
    )


def _bodies(rig: Transmission) -> list[DrawnBody]:
    """Return gears at their mean pitch radius, and bodies without a size at the radius of the disk of their inertia."""
    sizes: list[tuple[str, Gear | Disk, float, float, bool]] = []
    for name, gear in rig.gears.items():
        body, mesh = rig.gear_body(name), next(iter(rig.meshes_of(name)), None)
        radius = float(np.sqrt(2 * body.polar_inertia / body.mass))
        width = gear.body_length or 0.0
        if mesh is not None:
            radius = rig.geometries[mesh].radii[0 if rig.meshes[mesh].driving == name else 1]
            width = gear.body_length or rig.meshes[mesh].face_width
        sizes.append((name, gear, radius, width, mesh is not None))
    for name, disk in rig.disks.items():
        body = rig.disk_body(name)
        radius = (disk.outer_diameter or 2 * np.sqrt(2 * body.polar_inertia / body.mass)) / 2
        sizes.append((name, disk, float(radius), disk.width or 0.0, disk.outer_diameter is not None))
    return [
        DrawnBody(
            name=name,
            shaft=part.shaft,
            node=part.node,
            radius=radius,
            width=width,
            gear=isinstance(part, Gear),
            exact=exact,
        )
        for name, part, radius, width, exact in sizes
    ]


def _aligned(rig: Transmission) -> dict[str, FloatArray]:
    """Return the places of each shaft's nodes along the drawing, m; shafts in the order of power flow."""
    joints = [
        (rig.gears[a].shaft, rig.gears[a].node, rig.gears[b].shaft, rig.gears[b].node)
        for a, b in ((mesh.driving, mesh.driven) for mesh in rig.meshes.values())
    ]
    joints += [
        (coupling.shaft, coupling.node, coupling.to_shaft, coupling.to_node)
        for coupling in rig.couplings.values()
        if coupling.to_shaft is not None
    ]
    along = {
        name: np.cumsum([0.0, *(part.length / part.elements for part in shaft.segments for _ in range(part.elements))])
        for name, shaft in rig.shafts.items()
    }
    places: dict[str, FloatArray] = {}
    groups: list[list[str]] = []
    for start in (rig.drive_shaft, *rig.shafts):
        waiting = [(start, along.get(start, np.zeros(1)), True)]
        while waiting:
            name, place, alone = waiting.pop(0)
            if name in places:
                continue
            places[name] = place
            if alone:
                groups.append([name])
            else:
                groups[-1].append(name)
            links = [*joints, *((b, j, a, i) for a, i, b, j in joints)]
            near = [(other, i, j) for shaft, i, other, j in links if shaft == name]
            parallel = []
            apart = []
            for other, i, j in near:
                sense = float(rig.shafts[name].rotation[:, 2] @ rig.shafts[other].rotation[:, 2])
                if abs(sense) > 0.999:
                    turned = np.sign(sense) * np.sign(_sense(place)) * along[other]
                    parallel.append((other, place[i] + turned - turned[j], False))
                else:
                    apart.append((other, along[other], True))
            waiting = [*parallel, *waiting, *apart]
    for group in groups:
        left = min(float(places[name].min()) for name in group)
        for name in group:
            places[name] = places[name] - left
    return places


def _sense(place: FloatArray) -> float:
    """Return 1 where nodes run to the right, -1 to the left."""
    return -1.0 if len(place) > 1 and place[-1] < place[0] else 1.0
