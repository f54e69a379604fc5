"""Layout of the shafts of a train: bearings on both sides of the gears, machines at the ends."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from sigdb.transmission.known.stage_size import ALLOWABLE_SHEAR, StageSize, rounded, shaft_diameter

_ELEMENTS = 2


@dataclass(frozen=True, kw_only=True)
class ShaftLayout:
    """A shaft of a train.

    Attributes
    ----------
    name
        Name of the shaft.
    diameter, room
        Its diameter, and the greatest that its gears leave room for, m.
    reason
        Source of the diameter.
    narrowest
        Stage of the gear that leaves least room.
    segments
        Length, m, and rule of each segment, from the left bearing on.
    gear_nodes
        Node of the gear of each stage on it.
    members
        Stage of each gear on it, and 0 for the driving or 1 for the driven gear.
    right_node, end_node
        Nodes of the right bearing and of the machine.
    """

    name: str
    diameter: float
    room: float
    reason: str
    narrowest: int
    segments: tuple[tuple[float, str], ...]
    gear_nodes: dict[int, int]
    members: tuple[tuple[int, int], ...]
    right_node: int
    end_node: int


def shaft_layout(name: str, place: int, stages: Sequence[StageSize]) -> ShaftLayout:
    """Return the layout of a shaft of a train, from 0 for that of the drive."""
    members = tuple((stage, member) for stage, member in ((place - 1, 1), (place, 0)) if 0 <= stage < len(stages))
    sizes = [(stages[stage].diameters[member], stages[stage].module) for stage, member in members]
    stage, member = members[-1]
    torque = stages[stage].torque * (stages[stage].teeth[1] / stages[stage].teeth[0] if member else 1.0)
    diameter, room = shaft_diameter(torque, sizes)
    widths = [stages[stage].face_width for stage, _ in members]
    gaps = [widths[0] / 2, *((a + b) / 2 for a, b in pairwise(widths)), widths[-1] / 2]
    segments = [(rounded(gap + diameter), "of the face widths and a diameter between them") for gap in gaps]
    nodes = {stage: _ELEMENTS * (i + 1) for i, (stage, _) in enumerate(members)}
    right = _ELEMENTS * len(segments)
    if len(members) == 1:
        segments.append((rounded(2 * diameter), "of two diameters from the bearing to the coupling"))
    narrowest = min(range(len(sizes)), key=lambda i: sizes[i][0] - 2.5 * sizes[i][1])
    return ShaftLayout(
        name=name,
        diameter=diameter,
        room=room,
        reason=f"assumed: rule of {ALLOWABLE_SHEAR / 1e6:g} MPa of shear by {torque:.4g} N m, 0.1 pitch diameters of "
        "the greatest gear at least, and within the roots of the teeth",
        narrowest=members[narrowest][0],
        segments=tuple(segments),
        gear_nodes=nodes,
        members=members,
        right_node=right,
        end_node=_ELEMENTS * len(segments),
    )
