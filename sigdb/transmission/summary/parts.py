"""Facts of a rig's parts at its operating point: shafts, gears, disks, bearings, meshes, modes."""

from collections.abc import Iterator
from math import gcd

import numpy as np

from sigdb.transmission.rig import Transmission
from sigdb.transmission.summary.facts import (
    BearingFacts,
    BodyFacts,
    GearFacts,
    MeshFacts,
    ModeFacts,
    ResonanceFacts,
    ShaftFacts,
    ToothForceFacts,
)
from sigdb.transmission.system.elements import UNLOADED, pulled_apart
from sigdb.transmission.system.modal import coupled_modes, modal_system

MESH_ORDERS = (1, 2, 3)
"""Harmonics of a mesh frequency that are listed."""


def shaft_facts(rig: Transmission, name: str) -> ShaftFacts:
    """Return the facts of a shaft: length, mass, signed speed about its own z axis."""
    shaft = rig.shafts[name]
    mass = sum(
        rig.materials[segment.material or shaft.material or ""].density
        * np.pi / 4 * (segment.outer_diameter**2 - segment.inner_diameter**2) * segment.length
        for segment in shaft.segments
    )  # fmt: skip
    return {
        "name": name,
        "segments": len(shaft.segments),
        "nodes": shaft.nodes,
        "length": sum(segment.length for segment in shaft.segments),
        "mass": float(mass),
        "speed_rpm": float(rig.speed(name) * 30 / np.pi),
        "speed_hz": float(abs(rig.speed(name)) / (2 * np.pi)),
        "motions": list(shaft.motions),
    }


def gear_facts(rig: Transmission, name: str) -> GearFacts:
    """Return the facts of a gear: teeth, mean pitch radius and pitch angle where it meshes, inertia."""
    gear = rig.gears[name]
    mesh = next(iter(rig.meshes_of(name)), None)
    member = 0 if mesh and rig.meshes[mesh].driving == name else 1
    body = rig.gear_body(name)
    return {
        "name": name,
        "shaft": gear.shaft,
        "node": gear.node,
        "teeth": gear.teeth,
        "pitch_radius": rig.geometries[mesh].radii[member] if mesh else None,
        "pitch_angle_deg": rig.geometries[mesh].pitch_angles_deg[member] if mesh else None,
        "mass": body.mass,
        "polar_inertia": body.polar_inertia,
        "diametral_inertia": body.diametral_inertia,
    }


def disk_facts(rig: Transmission, name: str) -> BodyFacts:
    """Return the facts of a disk."""
    disk, body = rig.disks[name], rig.disk_body(name)
    return {
        "name": name,
        "shaft": disk.shaft,
        "node": disk.node,
        "mass": body.mass,
        "polar_inertia": body.polar_inertia,
        "diametral_inertia": body.diametral_inertia,
    }


def bearing_facts(rig: Transmission, name: str) -> BearingFacts:
    """Return the facts of a bearing: the diagonals of its stiffness and damping, and whether they have cross terms."""
    bearing = rig.bearings[name]
    stiffness, damping = bearing.matrices
    crossed = any(np.any(matrix - np.diag(np.diag(matrix))) for matrix in (stiffness, damping))
    return {
        "name": name,
        "shaft": bearing.shaft,
        "node": bearing.node,
        "seat": bearing.seat,
        "stiffness": np.diag(stiffness).tolist(),
        "damping": np.diag(damping).tolist(),
        "cross_terms": crossed,
    }


def mesh_facts(rig: Transmission) -> tuple[list[MeshFacts], list[ToothForceFacts]]:
    """Return the facts of the meshes, and of the static forces on their gears under the mean torque.

    Tangential forces are magnitudes, radial ones positive towards the gear's axis, axial ones along its shaft's z.
    """
    meshes: list[MeshFacts] = []
    forces: list[ToothForceFacts] = []
    if not rig.meshes:
        return meshes, forces
    static = modal_system(rig).transfer(np.zeros(1))[0, : len(rig.meshes), len(rig.meshes)].real
    for (name, mesh), compression in zip(rig.meshes.items(), static.tolist(), strict=True):
        geometry, frequency = rig.geometries[name], rig.mesh_frequency(name)
        z1, z2 = (rig.gears[gear].teeth for gear in (mesh.driving, mesh.driven))
        normal = mesh.stiffness * compression
        meshes.append(
            {
                "name": name,
                "driving": mesh.driving,
                "driven": mesh.driven,
                "ratio": z2 / z1,
                "stiffness": mesh.stiffness,
                "contact_ratio": mesh.profile.contact_ratio,
                "normal_force": normal,
                "static_compression": compression,
                "mesh_frequency_hz": frequency,
                "harmonics_hz": [order * frequency for order in MESH_ORDERS],
                "tooth_cycle_hz": frequency * gcd(z1, z2) / (z1 * z2),
            }
        )
        for gear, arm, sign in zip((mesh.driving, mesh.driven), geometry.arms, (-1, 1), strict=True):
            axis = rig.shafts[rig.gears[gear].shaft].rotation[:, 2]
            outwards = arm - (arm @ axis) * axis
            outwards = outwards / np.linalg.norm(outwards)
            force = sign * normal * geometry.normal
            tangential = float(abs(force @ np.cross(axis, outwards)))
            radial, axial = float(-force @ outwards), float(force @ axis)
            forces.append(
                {"mesh": name, "gear": gear, "tangential": tangential, "radial": radial, "axial": axial + 0.0}
            )
    return meshes, forces


def mesh_remarks(rig: Transmission, meshes: list[MeshFacts]) -> Iterator[str]:
    """Yield a sentence on each mesh that the torque pulls apart, does not press, or presses more than teeth bear."""
    names, compressions = [mesh["name"] for mesh in meshes], np.array([mesh["static_compression"] for mesh in meshes])
    yield from pulled_apart(rig, names, compressions)
    greatest = max((abs(mesh["normal_force"]) for mesh in meshes), default=0.0)
    for mesh in meshes:
        if greatest and abs(mesh["normal_force"]) <= UNLOADED * greatest:
            yield f"meshes.{mesh['name']} carries no torque, so that its teeth are not pressed together"
        if abs(mesh["static_compression"]) > _MOST_COMPRESSION:
            yield (
                f"meshes.{mesh['name']} has a static compression of {mesh['static_compression'] * 1e6:.4g} um, above "
                f"the usual {_MOST_COMPRESSION * 1e6:g} um; check operating.torque = {rig.operating.torque:g} N m and "
                f"stiffness = {mesh['stiffness']:.4g} N/m"
            )


_MOST_COMPRESSION = 1e-4
_SHAFT_ORDERS = 10
_NEAR = 0.05
_NO_PEAK = 0.7
"""Damping ratio from which on a mode's response has no peak."""
_LEAST_MODES = 6


def mode_facts(rig: Transmission) -> tuple[list[ModeFacts], int]:
    """Return the modes that vibrate, to three times the highest mesh frequency, and the number of those that do not."""
    modes = coupled_modes(rig)
    turning = max(abs(rig.speed(name)) for name in rig.shafts) / (2 * np.pi)
    meshing = max((rig.mesh_frequency(name) for name in rig.meshes), default=0.0)
    limit = MESH_ORDERS[-1] * meshing or _SHAFT_ORDERS * turning
    rows: list[ModeFacts] = [
        {"frequency_hz": float(frequency), "damping_ratio": float(ratio), "moves": moves}
        for frequency, ratio, moves in zip(modes.frequency_hz, modes.damping_ratio, modes.moves, strict=True)
        if frequency > 0
    ]
    rows.sort(key=lambda row: row["frequency_hz"])
    within = [row for i, row in enumerate(rows) if i < _LEAST_MODES or row["frequency_hz"] <= limit]
    return within, len(modes.frequency_hz) - len(rows)


def resonances(rig: Transmission, modes: list[ModeFacts]) -> Iterator[ResonanceFacts]:
    """Yield the modes near the speed of a shaft or a harmonic of a mesh frequency."""
    exciting = [(f"shaft {name}", 1, abs(rig.speed(name)) / (2 * np.pi)) for name in rig.shafts]
    exciting += [(f"mesh {name}", n, n * rig.mesh_frequency(name)) for name in rig.meshes for n in MESH_ORDERS]
    for mode in modes:
        if mode["damping_ratio"] >= _NO_PEAK:
            continue
        for what, order, frequency in exciting:
            if frequency and abs(mode["frequency_hz"] / frequency - 1) <= _NEAR:
                yield {**mode, "excited_by": what, "order": order, "excitation_hz": float(frequency)}
