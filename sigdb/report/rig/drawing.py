"""The drawing of a rig: side views of its shafts, one below the other, with all that sits on them."""

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sigdb.core import FloatArray
from sigdb.report.rig.layout import DrawnBody, Layout, lay_out
from sigdb.transmission import Transmission

INK, SENSOR = "#1f3a5f", "#c8553d"


def draw_box(
    axes: Axes, x: float, y: float, width: float, half: float, colour: str, *, style: str = "-", zorder: float = 1.5
) -> None:
    """Draw a rectangle from x to x + width, half above and half below y."""
    axes.add_patch(
        Rectangle((x, y - half), width, 2 * half, facecolor=colour, edgecolor=INK, linewidth=0.8, linestyle=style,
                  zorder=zorder)
    )  # fmt: skip


def draw_zigzag(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    """Draw a spring."""
    a, b = np.array(start), np.array(end)
    along = np.array([0, 0.2, 0.27, 0.4, 0.53, 0.66, 0.8, 1.0])
    across = 0.05 * np.array([0, 0, 1, -1, 1, -1, 0, 0])
    normal = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a)
    points = a + along[:, None] * (b - a) + across[:, None] * normal
    axes.plot(points[:, 0], points[:, 1], color=INK, linewidth=0.9, zorder=3)


def draw_arrow(axes: Axes, x: float, y: float, right: float, up: float) -> None:
    """Draw a sensor's direction in the side view."""
    if np.hypot(right, up) < 0.1:
        axes.plot([x], [y], marker="o", markersize=8, fillstyle="none", color=SENSOR, zorder=5)
        axes.plot([x], [y], marker=".", markersize=4, color=SENSOR, zorder=5)
        return
    axes.annotate(
        "", (x + 0.4 * right, y + 0.4 * up), (x, y), zorder=5,
        arrowprops={"arrowstyle": "-|>", "color": SENSOR, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip


def draw_text(axes: Axes, x: float, y: float, text: str, colour: str, *, size: float = 8.0) -> None:
    """Write a word that hides the lines behind it."""
    box = {"boxstyle": "square,pad=0.08", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    axes.text(x, y, text, fontsize=size, color=colour, ha="center", va="center", bbox=box, zorder=5)


_SHAFT, _GEAR, _DISK, _MESH = "#dde3ea", "#9dbbd9", "#dccb9f", "#6b6b6b"
_LINE, _GAP, _SPRING, _LETTER = 0.15, 0.1, 0.3, 0.068
"""Inches: height of a line of text, gaps, length of a spring, width of a letter."""
_SIDE, _TITLE, _BETWEEN = 2.0, 0.25, 0.35
"""Inches: room for machines next to the shafts, for a shaft's title, and for a mesh's label between rows."""

Label = tuple[float, list[tuple[str, str]], float]
"""Place along the shaft, lines with their colours, and distance from the axis of what it belongs to; inches."""


@dataclass(frozen=True, kw_only=True)
class _Row:
    """A shaft's row: its labels by lanes, and how far it reaches above and below its axis, inches."""

    shaft: str
    above: list[tuple[float, Label]]
    below: list[tuple[float, Label]]
    radius: float
    up: float
    down: float


def rig_figure(rig: Transmission) -> Figure:
    """Draw side views of all shafts, driven below driving, with nodes numbered.

    Gears are rectangles of their mean pitch diameter, disks of their outer one. A body that is given as numbers has a
    dashed outline and the diameter of the solid disk of its mass and inertia. Springs are bearings, to the ground
    (hatched) or to a seat on the casing (plate). Parallel shafts stand so that gears in mesh are in line. Arrows are
    sensors, a circle with a dot one across the drawing. Radii have their own scale where true ones would not be
    legible; a text in the drawing states this.

    Parameters
    ----------
    rig : Transmission
        The rig.

    Returns
    -------
    matplotlib.figure.Figure
        The drawing.
    """
    at = lay_out(rig)
    rows = [_row(rig, at, name) for name in at.nodes]
    height = sum(row.up + row.down + _TITLE + _BETWEEN for row in rows) + 1.0
    title = rig.title or rig.name
    width = max(float(place.max()) for place in at.nodes.values()) * at.axial + 2 * _SIDE
    width = max(width, len(title) * 1.35 * _LETTER + 0.4)
    with matplotlib.rc_context({"font.size": 8}):
        figure = Figure(figsize=(width, height))
        FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set(xlim=(-_SIDE, width - _SIDE), ylim=(0, height))
        axes.set_axis_off()
        axes.text(-_SIDE + _GAP, height - 0.15, title, fontsize=11, va="top")
        y, levels = height - 0.45, {}
        for row in rows:
            y -= _TITLE + row.up
            levels[row.shaft] = y
            _draw_row(axes, rig, at, row, y)
            y -= row.down + _BETWEEN
        _draw_joints(axes, rig, at, levels, {row.shaft: row.down for row in rows})
        _draw_scale(axes, at)
    return figure


def _row(rig: Transmission, at: Layout, shaft: str) -> _Row:
    above, below = [], []
    bodies = [body for body in at.bodies if body.shaft == shaft]
    for body in bodies:
        teeth = f"{body.name}, {rig.gears[body.name].teeth} teeth" if body.gear else body.name
        lines = [(teeth, INK)]
        lines += [(name, SENSOR) for name, sensor in rig.sensors.items() if body.gear and sensor.gear == body.name]
        above.append((at.x(shaft, body.node), lines, body.radius * at.radial))
    for name, bearing in rig.bearings.items():
        if bearing.shaft == shaft:
            seat = f"{name} (seat {bearing.seat})" if bearing.seat not in (None, name) else name
            lines = [(seat, INK)]
            if bearing.seat is not None:
                lines += [(key, SENSOR) for key, sensor in rig.sensors.items() if sensor.point == bearing.seat]
            below.append((at.x(shaft, bearing.node), lines, _surface(rig, at, shaft, bearing.node) + _SPRING))
    radius = max([_surface(rig, at, shaft, node) for node in range(rig.shafts[shaft].nodes)])
    # An arrow on a gear must not reach into the labels.
    measured = any(sensor.gear in {body.name for body in bodies} for sensor in rig.sensors.values() if sensor.gear)
    above_lanes, up = _lanes(above, max(radius, 0.42 if measured else 0.0) + _GAP)
    below_lanes, down = _lanes(below, max([radius, *(depth for _, _, depth in below)]) + _GAP)
    return _Row(shaft=shaft, above=above_lanes, below=below_lanes, radius=radius, up=up, down=down + 2 * _LINE)


def _lanes(labels: list[Label], start: float) -> tuple[list[tuple[float, Label]], float]:
    """Return labels with distances from the axis at which none overlaps another, and the greatest distance."""
    placed: list[tuple[float, Label]] = []
    boxes: list[tuple[float, float, float, float]] = []
    for label in sorted(labels, key=lambda label: label[0]):
        half = max(len(text) for text, _ in label[1]) * _LETTER / 2 + 0.04
        tall, at = len(label[1]) * _LINE + 0.04, start
        while any(abs(label[0] - x) < half + w and at < b and at + tall > a for x, w, a, b in boxes):
            at += _LINE / 3
        boxes.append((label[0], half, at, at + tall))
        placed.append((at, label))
    return placed, max([start, *(box[3] for box in boxes)])


def _surface(rig: Transmission, at: Layout, shaft: str, node: int) -> float:
    """Return the greatest radius at a node, of the shaft or of a body, inches."""
    radii = [body.radius for body in at.bodies if (body.shaft, body.node) == (shaft, node)]
    first = 0
    for segment in rig.shafts[shaft].segments:
        if first <= node <= first + segment.elements:
            radii.append(segment.outer_diameter / 2)
        first += segment.elements
    return max(radii, default=0.05 / at.radial) * at.radial


def _draw_row(axes: Axes, rig: Transmission, at: Layout, row: _Row, y: float) -> None:
    shaft, name = rig.shafts[row.shaft], row.shaft
    turning = f"{rig.speed(name) * 30 / np.pi:+.6g} rpm about z"
    axes.text(
        -_SIDE + _GAP, y + row.up + 0.08, f"{name}: {turning}",
        fontsize=9, weight="bold", va="bottom", zorder=6, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )  # fmt: skip
    node = 0
    for segment in shaft.segments:
        ends = at.x(name, node), at.x(name, node + segment.elements)
        draw_box(axes, min(ends), y, abs(ends[1] - ends[0]), segment.outer_diameter / 2 * at.radial, _SHAFT)
        if segment.inner_diameter:
            bore = segment.inner_diameter / 2 * at.radial
            draw_box(axes, min(ends), y, abs(ends[1] - ends[0]), bore, "white", style=":")
        node += segment.elements
    for body in (body for body in at.bodies if body.shaft == name):
        _draw_body(axes, rig, at, body, y)
    for key, bearing in rig.bearings.items():
        if bearing.shaft == name:
            _draw_bearing(axes, rig, key, at.x(name, bearing.node), y - _surface(rig, at, name, bearing.node))
    _draw_machines(axes, rig, at, name, y)
    for sign, labels in ((1, row.above), (-1, row.below)):
        for lane, (x, lines, reach) in labels:
            if lane - reach > 0.2:
                axes.plot([x, x], [y + sign * reach, y + sign * lane], color=INK, linewidth=0.4, linestyle=":")
            for i, (text, colour) in enumerate(lines if sign < 0 else lines[::-1]):
                where = y + sign * (lane + (i + 0.5) * _LINE)
                draw_text(axes, x, where, text, colour)
    _draw_nodes(axes, at.nodes[name] * at.axial, y - row.down + 1.4 * _LINE, _occupied(rig, name))


def _draw_body(axes: Axes, rig: Transmission, at: Layout, body: DrawnBody, y: float) -> None:
    width = max(body.width * at.axial, 0.07)
    x = at.x(body.shaft, body.node)
    colour, style = (_GEAR if body.gear else _DISK), ("-" if body.exact else "--")
    draw_box(axes, x - width / 2, y, width, body.radius * at.radial, colour, style=style, zorder=2)
    for sensor in rig.sensors.values():
        if body.gear and sensor.gear == body.name:
            seen = np.asarray(sensor.direction) @ rig.shafts[body.shaft].rotation / np.linalg.norm(sensor.direction)
            sense = -1.0 if len(at.nodes[body.shaft]) > 1 and np.diff(at.nodes[body.shaft])[0] < 0 else 1.0
            draw_arrow(axes, x, y, sense * seen[2], seen[1])


def _draw_bearing(axes: Axes, rig: Transmission, name: str, x: float, y: float) -> None:
    """Draw a spring from the surface down to the ground or to a seat."""
    draw_zigzag(axes, (x, y), (x, y - _SPRING + 0.07))
    seat, low = rig.bearings[name].seat, y - _SPRING
    colour, hatch = ("white", "//////") if seat is None else ("#b9b9b9", None)
    axes.add_patch(
        Rectangle((x - 0.14, low), 0.28, 0.07, facecolor=colour, hatch=hatch, edgecolor=INK, linewidth=0.6, zorder=3)
    )
    for sensor in rig.sensors.values():
        if seat is not None and sensor.point == seat:
            seen = np.asarray(sensor.direction) @ rig.shafts[rig.bearings[name].shaft].rotation
            draw_arrow(axes, x + 0.2, low, seen[2] / np.linalg.norm(seen), seen[1] / np.linalg.norm(seen))


def _draw_machines(axes: Axes, rig: Transmission, at: Layout, shaft: str, y: float) -> None:
    """Draw end machines as boxes behind springs, next to the nearer end of the shaft."""
    place, used = at.nodes[shaft] * at.axial, {-1: 0, 1: 0}
    reach = max([0.0, *(body.width * at.axial / 2 for body in at.bodies if body.shaft == shaft)])
    for name, coupling in rig.couplings.items():
        if coupling.shaft != shaft or coupling.inertia is None:
            continue
        x, middle = at.x(shaft, coupling.node), (place.min() + place.max()) / 2
        side = 1 if x > middle or (x == middle and name != rig.operating.drive) else -1
        edge = (place.max() if side > 0 else place.min()) + side * (reach if np.ptp(place) == 0 else 0)
        level = y - 0.55 * used[side]
        used[side] += 1
        start = x if x in (place.min(), place.max()) and np.ptp(place) else edge
        if start != x or level != y:
            axes.plot([x, start], [y, level], color=INK, linewidth=0.6, linestyle=":", zorder=4)
        lines = f"{name}\n{coupling.inertia:.3g} kg m$^2$"
        width = max(len(name), 12) * _LETTER + 0.1
        draw_zigzag(axes, (start, level), (start + side * 0.45, level))
        left = start + side * 0.45 - (width if side < 0 else 0)
        draw_box(axes, left, level, width, 0.2, "white", zorder=3)
        draw_text(axes, left + width / 2, level, lines, INK)


def _draw_nodes(axes: Axes, place: FloatArray, y: float, first: list[int]) -> None:
    """Draw a ruler with the numbers of the nodes; without room for all, nodes with parts come first."""
    axes.plot([place.min(), place.max()], [y, y], color="#999999", linewidth=0.8)
    used: list[tuple[float, int]] = []
    for node in [*first, *(i for i in range(len(place)) if i not in first)]:
        axes.plot([place[node]] * 2, [y - 0.03, y + 0.03], color="#999999", linewidth=0.8)
        for line in (0, 1) if node in first else (0,):
            if all(abs(place[node] - other) > 0.15 or line != lane for other, lane in used):
                used.append((float(place[node]), line))
                draw_text(axes, float(place[node]), y - 0.1 - 0.11 * line, str(node), "#555555", size=6.5)
                break
    if len(place) > 1:
        axes.annotate(
            "", (place[-1] + np.sign(place[-1] - place[0]) * 0.3, y), (place[-1], y),
            arrowprops={"arrowstyle": "->", "color": "#999999", "linewidth": 0.8},
        )  # fmt: skip
        draw_text(axes, float(place[-1] + np.sign(place[-1] - place[0]) * 0.38), y, "z", "#777777", size=7)


def _occupied(rig: Transmission, shaft: str) -> list[int]:
    places = [(part.shaft, part.node) for part in rig.bearings.values()]
    places += [(part.shaft, part.node) for part in rig.couplings.values()]
    places += [(part.shaft, part.node) for part in (*rig.gears.values(), *rig.disks.values())]
    return sorted({node for name, node in places if name == shaft})


def _draw_joints(axes: Axes, rig: Transmission, at: Layout, levels: dict[str, float], down: dict[str, float]) -> None:
    """Draw meshes and couplings between shafts, labelled in the gap below the upper of the two rows."""
    bodies = {body.name: body for body in at.bodies if body.gear}
    joints = []
    for name, mesh in rig.meshes.items():
        a, b = bodies[mesh.driving], bodies[mesh.driven]
        label = f"mesh {name}, {rig.gears[a.name].teeth}/{rig.gears[b.name].teeth} teeth"
        joints.append((label, (a.shaft, a.node, a.radius), (b.shaft, b.node, b.radius)))
    for name, coupling in rig.couplings.items():
        if coupling.to_shaft is not None:
            ends_of = (coupling.shaft, coupling.node, 0.0), (coupling.to_shaft, coupling.to_node, 0.0)
            joints.append((f"coupling {name}", *ends_of))
    for label, *ends in joints:
        (x1, y1, r1, upper), (x2, y2, r2, _) = sorted(
            ((at.x(shaft, node), levels[shaft], radius * at.radial, shaft) for shaft, node, radius in ends),
            key=lambda end: -end[1],
        )
        start, end = (x1, y1 - r1), (x2, y2 + r2)
        axes.plot(*zip(start, end, strict=True), color=_MESH, linewidth=1.0, linestyle="--", zorder=1)
        level = y1 - down[upper] - _BETWEEN / 2
        x = start[0] + (end[0] - start[0]) * (start[1] - level) / (start[1] - end[1])
        draw_text(axes, x, level, label, _MESH)


def _draw_scale(axes: Axes, at: Layout) -> None:
    decade = 10 ** np.floor(np.log10(1.5 / at.axial))
    size = max(step * decade for step in (1, 2, 5) if step * decade <= 1.5 / at.axial)
    shown = f"{size * 1e3:g} mm" if size < 1 else f"{size:g} m"
    axes.plot([0, size * at.axial], [0.2, 0.2], color=INK, linewidth=2, solid_capstyle="butt")
    ratio = at.radial / at.axial
    radii = "radii to the same scale" if np.isclose(ratio, 1) else f"radii drawn {ratio:.2g} times as large"
    axes.text(size * at.axial + 0.1, 0.2, f"{shown}; {radii}", va="center", fontsize=7.5, color=INK)
