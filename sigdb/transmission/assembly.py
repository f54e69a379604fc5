"""The assembled equations of a rig, before any modal reduction: equations (1) to (4) of the paper.

``M q'' + (C + G) q' + K q = F - sum over meshes h k(t) (h' q - e)``, with the degrees of freedom of each shaft's
nodes (in the shaft's frame), then of each coupling's machine, then the casing's modal coordinates.
Every spring is rank one: a direction b in q and a stiffness, ``K += b k b'``.
"""

from dataclasses import dataclass

import numpy as np

from sigdb.core.typing import FloatArray
from sigdb.transmission.beam import beam_element
from sigdb.transmission.gears import Gear, gear_body
from sigdb.transmission.rig import Transmission
from sigdb.transmission.supports import Bearing

DOF = 6
"""Degrees of freedom of a node: u, v, w, theta_x, theta_y, theta_z in its shaft's frame."""


@dataclass(frozen=True, kw_only=True)
class Assembly:
    """Matrices of a rig with n degrees of freedom.

    Attributes
    ----------
    mass, stiffness
        (n, n); stiffness holds shafts, bearings, couplings and casing, but not the meshes.
    damping
        (n, n) viscous damping of the bearings and of the casing's modes.
    gyroscopic
        (n, n) at the operating speed.
    meshes
        (n, meshes) mesh vectors h.
    mesh_stiffness
        (meshes,) mean mesh stiffness, N/m.
    bearings
        (n, k) directions of the bearings' springs.
    torque
        (n,) force of the operating torque: in at the drive, out at the load, in balance.
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
    bearings: FloatArray
    torque: FloatArray
    sensors: FloatArray
    free_rotation: FloatArray
    rotors: dict[str, list[int]]
    motions: dict[str, list[int]]

    @property
    def casing(self) -> list[int]:
        """Degrees of freedom of the casing's modes."""
        taken = {i for rotor in self.rotors.values() for i in rotor}
        return [i for i in range(len(self.mass)) if i not in taken]


class _Layout:
    """Which degree of freedom is where."""

    def __init__(self, rig: Transmission) -> None:
        self.offsets: dict[str, int] = {}
        self.machines: dict[str, int] = {}
        n = 0
        for name, shaft in rig.shafts.items():
            self.offsets[name] = n
            n += DOF * shaft.nodes
        for name in rig.couplings:
            self.machines[name] = n
            n += 1
        self.casing = list(range(n, n + len(rig.casing.modes)))
        self.size = n + len(rig.casing.modes)

    def node(self, shaft: str, node: int) -> int:
        """First degree of freedom of a node."""
        return self.offsets[shaft] + DOF * node

    def shaft(self, rig: Transmission, name: str, kinds: tuple[int, ...] = tuple(range(DOF))) -> list[int]:
        """Degrees of freedom of some kinds of all the nodes of a shaft."""
        return [self.node(name, node) + kind for node in range(rig.shafts[name].nodes) for kind in kinds]


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

    for name, shaft in rig.shafts.items():
        first = at.offsets[name]
        for segment in shaft.segments:
            element = beam_element(
                segment.length / segment.elements,
                segment.outer_diameter,
                segment.inner_diameter,
                rig.materials[shaft.material],
            )
            for _ in range(segment.elements):
                span = slice(first, first + 2 * DOF)
                mass[span, span] += element.mass
                stiffness[span, span] += element.stiffness
                gyroscopic[span, span] += rig.speed(name) * element.gyroscopic
                first += DOF

    for mesh_name, mesh in rig.meshes.items():
        for gear_name, radius in zip((mesh.driving, mesh.driven), rig.geometries[mesh_name].radii, strict=True):
            gear = rig.gears[gear_name]
            body = gear_body(gear, rig.materials[gear.material], radius)
            i = at.node(gear.shaft, gear.node)
            inertia = np.array([body.mass] * 3 + [body.diametral_inertia] * 2 + [body.polar_inertia])
            mass[range(i, i + DOF), range(i, i + DOF)] += inertia
            moment = rig.speed(gear.shaft) * body.polar_inertia
            gyroscopic[i + 3, i + 4] += moment
            gyroscopic[i + 4, i + 3] -= moment

    for name, coupling in rig.couplings.items():
        machine, node = at.machines[name], at.node(coupling.shaft, coupling.node) + 5
        mass[machine, machine] += coupling.inertia
        twist = np.zeros(n)
        twist[machine], twist[node] = 1.0, -1.0
        stiffness += coupling.stiffness * np.outer(twist, twist)

    springs = []
    for bearing in rig.bearings.values():
        b, k, c = _bearing_springs(rig, at, bearing)
        stiffness += b @ np.diag(k) @ b.T
        damping += b @ np.diag(c) @ b.T
        springs.append(b)

    for i, mode in zip(at.casing, rig.casing.modes, strict=True):
        omega = 2 * np.pi * mode.frequency_hz
        mass[i, i] = mode.modal_mass
        stiffness[i, i] += mode.modal_mass * omega**2
        damping[i, i] += 2 * mode.damping_ratio * omega * mode.modal_mass

    return Assembly(
        mass=mass,
        stiffness=stiffness,
        damping=damping,
        gyroscopic=gyroscopic,
        meshes=np.column_stack([_mesh_vector(rig, at, name) for name in rig.meshes]),
        mesh_stiffness=np.array([mesh.stiffness for mesh in rig.meshes.values()]),
        bearings=np.column_stack(springs),
        torque=_torque(rig, at),
        sensors=np.array([_sensor_row(rig, at, name) for name in rig.sensors]),
        free_rotation=_free_rotation(rig, at),
        rotors={name: at.shaft(rig, name) + _machines_on(rig, at, name) for name in rig.shafts},
        motions=_motions(rig, at),
    )


def _machines_on(rig: Transmission, at: _Layout, shaft: str) -> list[int]:
    return [at.machines[name] for name, coupling in rig.couplings.items() if coupling.shaft == shaft]


def _bearing_springs(rig: Transmission, at: _Layout, bearing: Bearing) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Directions, stiffness and damping of a bearing's springs, equation (3): translations and tilts that it holds."""
    b = np.zeros((at.size, 5))
    node = at.node(bearing.shaft, bearing.node)
    b[range(node, node + 5), range(5)] = 1.0
    if bearing.seat is not None:
        b[at.casing, :3] = -(rig.shafts[bearing.shaft].rotation.T @ rig.casing.shapes(bearing.seat)).T
    k = np.array([*bearing.stiffness, *[bearing.tilt_stiffness] * 2])
    c = np.array([*bearing.damping, 0.0, 0.0])
    acts = (k > 0) | (c > 0)
    return b[:, acts], k[acts], c[acts]


def _mesh_vector(rig: Transmission, at: _Layout, name: str) -> FloatArray:
    """h of a mesh, turned from the casing's frame into those of the two shafts."""
    mesh, vector = rig.meshes[name], np.zeros(at.size)
    for gear_name, h in zip((mesh.driving, mesh.driven), rig.geometries[name].vector.reshape(2, 2, 3), strict=True):
        gear = rig.gears[gear_name]
        node = at.node(gear.shaft, gear.node)
        vector[node : node + DOF] += (h @ rig.shafts[gear.shaft].rotation).ravel()
    return vector


def _torque(rig: Transmission, at: _Layout) -> FloatArray:
    """The drive's torque in its sense of rotation, and the load's that keeps the same power."""
    drive, load = rig.operating.drive, rig.operating.load
    speed_in, speed_out = (rig.speed(rig.couplings[name].shaft) for name in (drive, load))
    force = np.zeros(at.size)
    force[at.machines[drive]] = rig.operating.torque * np.sign(speed_in)
    force[at.machines[load]] = -force[at.machines[drive]] * speed_in / speed_out
    return force


def _free_rotation(rig: Transmission, at: _Layout) -> FloatArray:
    """Angles of all nodes and machines when the train turns, scaled to 1 at the drive's shaft."""
    v = np.zeros(at.size)
    for name in rig.shafts:
        v[at.shaft(rig, name, (5,)) + _machines_on(rig, at, name)] = rig.speed(name)
    return v / np.abs(v).max()


def _sensor_row(rig: Transmission, at: _Layout, name: str) -> FloatArray:
    sensor, row = rig.sensors[name], np.zeros(at.size)
    direction = np.asarray(sensor.direction) / np.linalg.norm(sensor.direction)
    if sensor.gear is not None:
        gear: Gear = rig.gears[sensor.gear]
        node = at.node(gear.shaft, gear.node)
        row[node : node + 3] = direction @ rig.shafts[gear.shaft].rotation
    else:
        assert sensor.point is not None
        row[at.casing] = direction @ rig.casing.shapes(sensor.point)
    return row


def _motions(rig: Transmission, at: _Layout) -> dict[str, list[int]]:
    motions = {}
    for name in rig.shafts:
        motions[f"{name} bending"] = at.shaft(rig, name, (0, 1, 3, 4))
        motions[f"{name} axial"] = at.shaft(rig, name, (2,))
        motions[f"{name} torsion"] = at.shaft(rig, name, (5,))
    motions |= {f"{name} machine": [i] for name, i in at.machines.items()}
    if at.casing:
        motions["casing"] = at.casing
    return motions
