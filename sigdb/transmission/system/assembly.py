"""The assembled equations of a rig, before any modal reduction: equations (1) to (4) of the paper.

``M q'' + (C + G) q' + K q = F - sum over meshes h k(t) (h' q - e)``, with the degrees of freedom of each shaft's
nodes (in the shaft's frame), then of each end machine, then the casing's modal coordinates.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.transmission.parts.bodies import Body
from sigdb.transmission.parts.shafts import MOTIONS
from sigdb.transmission.parts.supports import Bearing, Coupling
from sigdb.transmission.rig import Transmission
from sigdb.transmission.system.beam import beam_element

DOF = 6
"""Degrees of freedom of a node: u, v, w, theta_x, theta_y, theta_z in its shaft's frame."""


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """Matrices of a rig with n degrees of freedom.

    Attributes
    ----------
    mass, stiffness
        (n, n); stiffness holds shafts, bearings, couplings and casing, but not the meshes. It is symmetric but for
        the cross terms of bearings.
    damping
        (n, n) viscous damping of bearings, couplings, meshes and of the casing's modes.
    gyroscopic
        (n, n) at the operating speed.
    meshes
        (n, meshes) mesh vectors h.
    mesh_stiffness
        (meshes,) mean mesh stiffness, N/m.
    friction
        (n, 2 meshes) vectors f0, f1 of each mesh's friction.
    bearings
        (n, k) directions in which bearings act.
    torque
        (n,) force of the mean torque: in at the drive, out at the load, in balance.
    load
        (n,) force of the load's torque alone.
    unbalance
        (n, 2 k) force of the unbalance of each of the k shafts that have one: its part in phase with the cosine, then
        with the sine, of the shaft's angle.
    sensors
        (sensors, n) displacement seen by each sensor, m.
    free_rotation
        (n,) the train turning as a whole, which compresses no mesh.
    rotors
        Degrees of freedom of each rotor (shaft and machines) by the shaft's name; the rest is the casing's.
    motions
        Degrees of freedom by what they move, for example ``"pinion-shaft bending"``.
    """

    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    gyroscopic: FloatArray
    meshes: FloatArray
    mesh_stiffness: FloatArray
    friction: FloatArray
    bearings: FloatArray
    torque: FloatArray
    load: FloatArray
    unbalance: FloatArray
    sensors: FloatArray
    free_rotation: FloatArray
    rotors: dict[str, list[int]]
    motions: dict[str, list[int]]

    @property
    def casing(self) -> list[int]:
        """Degrees of freedom of the casing's modes."""
        taken = {i for rotor in self.rotors.values() for i in rotor}
        return [i for i in range(len(self.mass)) if i not in taken]

    def restricted(self, kept: IntArray) -> Self:
        """The assembly with only some degrees of freedom; the others do not move."""
        place = {int(old): new for new, old in enumerate(kept)}
        square, both = np.ix_(kept, kept), ("mass", "stiffness", "damping", "gyroscopic")
        tall = ("meshes", "friction", "bearings", "torque", "load", "unbalance", "free_rotation")
        return type(self)(
            **{name: getattr(self, name)[square] for name in both},
            **{name: getattr(self, name)[kept] for name in tall},
            sensors=self.sensors[:, kept],
            mesh_stiffness=self.mesh_stiffness,
            rotors={name: [place[i] for i in dofs if i in place] for name, dofs in self.rotors.items()},
            motions={name: [place[i] for i in dofs if i in place] for name, dofs in self.motions.items()},
        )


class _Layout:
    """Which degree of freedom is where."""

    def __init__(self, rig: Transmission) -> None:
        self.rig = rig
        self.offsets: dict[str, int] = {}
        self.machines: dict[str, int] = {}
        n = 0
        for name, shaft in rig.shafts.items():
            self.offsets[name] = n
            n += DOF * shaft.nodes
        for name, coupling in rig.couplings.items():
            if coupling.inertia is not None:
                self.machines[name] = n
                n += 1
        self.casing = list(range(n, n + len(rig.casing.modes)))
        self.size = n + len(rig.casing.modes)

    def node(self, shaft: str, node: int) -> int:
        """First degree of freedom of a node."""
        return self.offsets[shaft] + DOF * node

    def shaft(self, name: str, kinds: tuple[int, ...] = tuple(range(DOF))) -> list[int]:
        """Degrees of freedom of some kinds of all the nodes of a shaft."""
        return [self.node(name, node) + kind for node in range(self.rig.shafts[name].nodes) for kind in kinds]

    def machines_on(self, shaft: str) -> list[int]:
        """Degrees of freedom of the end machines of a shaft."""
        return [i for name, i in self.machines.items() if self.rig.couplings[name].shaft == shaft]

    @property
    def kept(self) -> IntArray:
        """Degrees of freedom that can move: the motions of each shaft, machines, casing."""
        nodes = [
            i
            for name, shaft in self.rig.shafts.items()
            for i in self.shaft(name, tuple(kind for kind, motion in enumerate(MOTIONS) if motion in shaft.motions))
        ]
        return np.array([*nodes, *self.machines.values(), *self.casing])


def assemble(rig: Transmission) -> Assembly:
    """Assemble a rig at its operating point.

    Examples
    --------
    >>> import numpy as np, sigdb
    >>> rig = sigdb.load_transmission("nasa-spiral-bevel")
    >>> parts = assemble(rig)
    >>> bool(abs(parts.stiffness @ parts.free_rotation).max() < 1e-6 * abs(parts.stiffness).max())
    True
    """
    at = _Layout(rig)
    n = at.size
    mass, stiffness, damping, gyroscopic = (np.zeros((n, n)) for _ in range(4))
    _add_shafts(rig, at, mass, stiffness, gyroscopic)
    _add_bodies(rig, at, mass, gyroscopic)

    for name, coupling in rig.couplings.items():
        if coupling.inertia is not None:
            mass[at.machines[name], at.machines[name]] += coupling.inertia
        for b, k, c in _coupling_springs(at, name, coupling):
            stiffness += k * np.outer(b, b)
            damping += c * np.outer(b, b)

    bearings = [_bearing_directions(rig, at, bearing) for bearing in rig.bearings.values()]
    for b, bearing in zip(bearings, rig.bearings.values(), strict=True):
        k6, c6 = bearing.matrices
        stiffness += b @ k6 @ b.T
        damping += b @ c6 @ b.T

    for i, mode in zip(at.casing, rig.casing.modes, strict=True):
        omega = 2 * np.pi * mode.frequency_hz
        mass[i, i] = mode.modal_mass
        stiffness[i, i] += mode.modal_mass * omega**2
        damping[i, i] += 2 * mode.damping_ratio * omega * mode.modal_mass

    meshes = np.array([_on_pair(rig, at, name, rig.geometries[name].vector) for name in rig.meshes]).reshape(-1, n).T
    across = [_on_pair(rig, at, name, f) for name in rig.meshes for f in rig.geometries[name].friction]
    damping += meshes @ np.diag([mesh.damping for mesh in rig.meshes.values()]) @ meshes.T
    load = _load(rig, at)
    directions = np.hstack([*bearings, np.zeros((n, 0))])
    return Assembly(
        mass=mass,
        stiffness=stiffness,
        damping=damping,
        gyroscopic=gyroscopic,
        meshes=meshes,
        mesh_stiffness=np.array([mesh.stiffness for mesh in rig.meshes.values()]),
        friction=np.array(across).reshape(-1, n).T,
        bearings=directions[:, np.any(directions.T @ (stiffness + damping), axis=1)],
        torque=_drive(rig, at) + load,
        load=load,
        unbalance=np.hstack([np.zeros((n, 0)), *(_unbalance(rig, at, name) for name in rig.unbalanced)]),
        sensors=np.array([_sensor_row(rig, at, name) for name in rig.sensors]).reshape(-1, n),
        free_rotation=_free_rotation(rig, at),
        rotors={name: at.shaft(name) + at.machines_on(name) for name in rig.shafts},
        motions=_motions(rig, at),
    ).restricted(at.kept)


def _add_shafts(
    rig: Transmission, at: _Layout, mass: FloatArray, stiffness: FloatArray, gyroscopic: FloatArray
) -> None:
    for name, shaft in rig.shafts.items():
        first = at.offsets[name]
        for segment in shaft.segments:
            element = beam_element(
                segment.length / segment.elements,
                segment.outer_diameter,
                segment.inner_diameter,
                rig.materials[segment.material or shaft.material or ""],
            )
            for _ in range(segment.elements):
                span = slice(first, first + 2 * DOF)
                mass[span, span] += element.mass
                stiffness[span, span] += element.stiffness
                gyroscopic[span, span] += rig.speed(name) * element.gyroscopic
                first += DOF


def _add_bodies(rig: Transmission, at: _Layout, mass: FloatArray, gyroscopic: FloatArray) -> None:
    bodies: list[tuple[str, int, Body]] = [
        (gear.shaft, gear.node, rig.gear_body(name)) for name, gear in rig.gears.items()
    ] + [(disk.shaft, disk.node, rig.disk_body(name)) for name, disk in rig.disks.items()]
    for shaft, node, body in bodies:
        i = at.node(shaft, node)
        inertia = np.array([body.mass] * 3 + [body.diametral_inertia] * 2 + [body.polar_inertia])
        mass[range(i, i + DOF), range(i, i + DOF)] += inertia
        moment = rig.speed(shaft) * body.polar_inertia
        gyroscopic[i + 3, i + 4] += moment
        gyroscopic[i + 4, i + 3] -= moment


def _coupling_springs(at: _Layout, name: str, coupling: Coupling) -> list[tuple[FloatArray, float, float]]:
    """Direction, stiffness and damping of a coupling's springs: torsion, and translations between two shafts."""
    node = at.node(coupling.shaft, coupling.node)
    torsion = np.zeros(at.size)
    torsion[node + 5] = -1.0
    if coupling.to_shaft is None:
        torsion[at.machines[name]] = 1.0
        return [(torsion, coupling.stiffness, coupling.damping)]
    other = at.node(coupling.to_shaft, coupling.to_node)
    turned = at.rig.shafts[coupling.shaft].rotation.T @ at.rig.shafts[coupling.to_shaft].rotation
    torsion[other + 3 : other + 6] = turned[2]
    springs: list[tuple[FloatArray, float, float]] = [(torsion, coupling.stiffness, coupling.damping)]
    for axis, k in enumerate(coupling.lateral_stiffness):
        b = np.zeros(at.size)
        b[node + axis] = -1.0
        b[other : other + 3] = turned[axis]
        springs.append((b, k, 0.0))
    return springs


def _bearing_directions(rig: Transmission, at: _Layout, bearing: Bearing) -> FloatArray:
    """(n, 6) motions across a bearing, equation (3): the node's, less those of its seat."""
    b = np.zeros((at.size, DOF))
    node = at.node(bearing.shaft, bearing.node)
    b[range(node, node + DOF), range(DOF)] = 1.0
    if bearing.seat is not None:
        b[at.casing, :3] = -(rig.shafts[bearing.shaft].rotation.T @ rig.casing.shapes(bearing.seat)).T
    return b


def _on_pair(rig: Transmission, at: _Layout, name: str, pair: FloatArray) -> FloatArray:
    """A (12,) vector of a gear pair, turned from the casing's frame into those of the two shafts."""
    mesh, vector = rig.meshes[name], np.zeros(at.size)
    for gear_name, h in zip((mesh.driving, mesh.driven), pair.reshape(2, 2, 3), strict=True):
        gear = rig.gears[gear_name]
        node = at.node(gear.shaft, gear.node)
        vector[node : node + DOF] += (h @ rig.shafts[gear.shaft].rotation).ravel()
    return vector


def _drive(rig: Transmission, at: _Layout) -> FloatArray:
    """The drive's torque in its sense of rotation."""
    force = np.zeros(at.size)
    if rig.operating.drive is not None:
        shaft = rig.couplings[rig.operating.drive].shaft
        force[at.machines[rig.operating.drive]] = rig.operating.torque * np.sign(rig.ratio(shaft))
    return force


def _load(rig: Transmission, at: _Layout) -> FloatArray:
    """The load's torque against its sense of rotation, of the drive's power."""
    force = np.zeros(at.size)
    if rig.operating.drive is not None and rig.operating.load is not None:
        ratio_in, ratio_out = (
            rig.ratio(rig.couplings[name].shaft) for name in (rig.operating.drive, rig.operating.load)
        )
        force[at.machines[rig.operating.load]] = -rig.operating.torque * abs(ratio_in) / ratio_out
    return force


def _unbalance(rig: Transmission, at: _Layout, shaft: str) -> FloatArray:
    """(n, 2) force of a shaft's unbalance: ``U W^2 (cos(phi + alpha), s sin(phi + alpha))`` along x, y, s the sense."""
    force = np.zeros((at.size, 2))
    speed = rig.speed(shaft)
    for body in (*rig.gears.values(), *rig.disks.values()):
        if body.shaft == shaft and body.unbalance:
            alpha = np.deg2rad(body.unbalance_angle_deg)
            x, y = at.node(shaft, body.node) + np.arange(2)
            size = body.unbalance * speed**2
            force[x] += size * np.array([np.cos(alpha), -np.sin(alpha)])
            force[y] += size * np.sign(speed) * np.array([np.sin(alpha), np.cos(alpha)])
    return force


def _free_rotation(rig: Transmission, at: _Layout) -> FloatArray:
    """Angles of all nodes and machines when the train turns, scaled to 1 at the fastest shaft."""
    v = np.zeros(at.size)
    for name in rig.shafts:
        v[at.shaft(name, (5,)) + at.machines_on(name)] = rig.ratio(name)
    return v / np.abs(v).max()


def _sensor_row(rig: Transmission, at: _Layout, name: str) -> FloatArray:
    sensor, row = rig.sensors[name], np.zeros(at.size)
    direction = np.asarray(sensor.direction) / np.linalg.norm(sensor.direction)
    if sensor.gear is not None:
        gear = rig.gears[sensor.gear]
        node = at.node(gear.shaft, gear.node)
        row[node : node + 3] = direction @ rig.shafts[gear.shaft].rotation
    else:
        assert sensor.point is not None
        row[at.casing] = direction @ rig.casing.shapes(sensor.point)
    return row


def _motions(rig: Transmission, at: _Layout) -> dict[str, list[int]]:
    motions = {}
    for name in rig.shafts:
        motions[f"{name} bending"] = at.shaft(name, (0, 1, 3, 4))
        motions[f"{name} axial"] = at.shaft(name, (2,))
        motions[f"{name} torsion"] = at.shaft(name, (5,))
    motions |= {f"{name} machine": [i] for name, i in at.machines.items()}
    if at.casing:
        motions["casing"] = at.casing
    return motions
