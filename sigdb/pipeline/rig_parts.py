"""Numbers of a rig's shafts, gears, bearings and meshes at its operating point."""

from math import gcd
from typing import Any

import numpy as np

from sigdb.transmission import Transmission, modal_system

MESH_ORDERS = (1, 2, 3)
"""Harmonics of a mesh frequency that are listed."""


def shaft_numbers(rig: Transmission, name: str) -> dict[str, Any]:
    """A shaft: length, mass, signed speed about its own z axis."""
    shaft = rig.shafts[name]
    mass = sum(
        rig.materials[one.material or shaft.material or ""].density
        * np.pi / 4 * (one.outer_diameter**2 - one.inner_diameter**2) * one.length
        for one in shaft.segments
    )  # fmt: skip
    return {
        "name": name,
        "segments": len(shaft.segments),
        "nodes": shaft.nodes,
        "length": sum(one.length for one in shaft.segments),
        "mass": float(mass),
        "speed_rpm": float(rig.speed(name) * 30 / np.pi),
        "speed_hz": float(abs(rig.speed(name)) / (2 * np.pi)),
        "motions": list(shaft.motions),
    }


def gear_numbers(rig: Transmission, name: str) -> dict[str, Any]:
    """A gear: teeth, mean pitch radius and pitch angle where it meshes, inertia."""
    gear = rig.gears[name]
    mesh = next(iter(rig.meshes_of(name)), None)
    member = 0 if mesh and rig.meshes[mesh].driving == name else 1
    return {
        "name": name,
        "shaft": gear.shaft,
        "node": gear.node,
        "teeth": gear.teeth,
        "pitch_radius": rig.geometries[mesh].radii[member] if mesh else None,
        "pitch_angle_deg": rig.geometries[mesh].pitch_angles_deg[member] if mesh else None,
        **rig.gear_body(name).model_dump(),
    }


def bearing_numbers(rig: Transmission, name: str) -> dict[str, Any]:
    """A bearing: the diagonals of its stiffness and damping, and whether they have cross terms."""
    bearing = rig.bearings[name]
    stiffness, damping = bearing.matrices
    crossed = any(np.any(one - np.diag(np.diag(one))) for one in (stiffness, damping))
    return {
        "name": name,
        "shaft": bearing.shaft,
        "node": bearing.node,
        "seat": bearing.seat,
        "stiffness": np.diag(stiffness).tolist(),
        "damping": np.diag(damping).tolist(),
        "cross_terms": crossed,
    }


def mesh_numbers(rig: Transmission) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Meshes, and the static forces on their gears under the mean torque.

    Tangential forces are magnitudes, radial ones positive towards the gear's axis, axial ones along its shaft's z.
    """
    meshes: list[dict[str, Any]] = []
    forces: list[dict[str, Any]] = []
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
