"""Verification: the modal system against a direct solution of the assembled second-order equations.

``(K + k h h' + i w (C + G) - w^2 M) q = f`` with the rotors' modal damping built here from its definition: on a fixed
casing every mode of the rotors (with the mean mesh stiffness) has the rig's damping ratio.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import cholesky, eigh, lstsq, solve

from sigdb.transmission import Transmission, load_transmission, modal_system
from sigdb.transmission.system.assembly import assemble

FREQUENCIES_HZ = [3.0, 80.0, 240.0, 960.0, 1920.0, 2530.0, 2880.0, 5760.0, 11520.0]
DERIVATIVE = {"displacement": 0, "velocity": 1, "acceleration": 2}


def with_many_sensors(rig):
    """Each measured quantity, at a gear and on the casing, in oblique directions; and damping in the bearings."""
    data = rig.model_dump()
    data["sensors"] = {}
    for quantity in DERIVATIVE:
        data["sensors"][f"gear-{quantity}"] = {"gear": "gear", "direction": (0.3, 1.0, -0.4), "quantity": quantity}
        data["sensors"][f"wall-{quantity}"] = {"point": "gear-left", "direction": (1.0, 1.0, 0.5), "quantity": quantity}
    for bearing in data["bearings"].values():
        bearing["damping"] = (800.0, 1200.0, 500.0)
        bearing["tilt_stiffness"] = 2e4
    return Transmission.model_validate(data)


def rotor_damping(parts, stiffness, ratio):
    """2 zeta M (M^-1 K)^(1/2) on the rotors, through the symmetric form L^-1 K L^-T of a Cholesky factor.

    It acts on their motion less that with which they follow the casing statically.
    """
    rotors = np.setdiff1d(np.arange(len(parts.mass)), parts.casing)
    take = np.ix_(rotors, rotors)
    factor = cholesky(parts.mass[take], lower=True)
    whitened = solve(factor, solve(factor, stiffness[take]).T)
    squares, vectors = eigh((whitened + whitened.T) / 2)
    squares[squares < 1e-12 * squares[-1]] = 0.0
    root = vectors @ np.diag(np.sqrt(squares)) @ vectors.T
    relative = np.eye(len(stiffness))[rotors]
    relative[:, parts.casing] = lstsq(stiffness[take], stiffness[np.ix_(rotors, parts.casing)], cond=1e-12)[0]
    return relative.T @ (2 * ratio * factor @ root @ factor.T) @ relative


def direct_transfer(rig):
    parts = assemble(rig)
    stiffness = parts.stiffness + parts.meshes @ np.diag(parts.mesh_stiffness) @ parts.meshes.T
    damping = parts.damping + parts.gyroscopic + rotor_damping(parts, stiffness, rig.damping_ratio)
    forces = np.column_stack([parts.meshes, parts.torque, parts.load, parts.friction])
    order = np.array([0] * len(rig.meshes) + [DERIVATIVE[sensor.quantity] for sensor in rig.sensors.values()])
    transfers = []
    for w in 2 * np.pi * np.array(FREQUENCIES_HZ):
        q = solve(stiffness + 1j * w * damping - w**2 * parts.mass, forces)
        transfers.append((1j * w) ** order[:, None] * (np.vstack([parts.meshes.T, parts.sensors]) @ q))
    return np.array(transfers)


@pytest.fixture(scope="module", params=["as-filed", "undamped-rotors", "gear-side-forward"])
def rig(request):
    rig = with_many_sensors(load_transmission("nasa-spiral-bevel"))
    changes = {
        "as-filed": {},
        "undamped-rotors": {"damping_ratio": 0.0},
        "gear-side-forward": {"operating.speed_rpm": 30000.0, "pinion.teeth": 17, "operating.rotation": 1},
    }
    return rig.replace(changes[request.param])


def test_every_transfer_is_that_of_the_direct_solution(rig):
    modal = modal_system(rig).transfer(2 * np.pi * np.array(FREQUENCIES_HZ))
    exact = direct_transfer(rig)
    # Transfers that pass near zero at one frequency are measured by their size over all of them.
    assert_allclose(np.abs(modal - exact) / np.abs(exact).max(axis=0), 0, atol=2e-8)


def test_the_static_response_is_the_direct_one_without_the_free_rotation(rig):
    """Bordered by the free rotation, which the response must not contain (no angular momentum of the train)."""
    parts = assemble(rig)
    stiffness = parts.stiffness + parts.meshes @ np.diag(parts.mesh_stiffness) @ parts.meshes.T
    border = (parts.mass @ parts.free_rotation)[:, None]
    scale = np.abs(stiffness).max() / np.abs(border).max()
    bordered = np.block([[stiffness, scale * border], [scale * border.T, np.zeros((1, 1))]])
    forces = np.column_stack([parts.meshes, parts.torque, parts.load, parts.friction])
    q = np.linalg.solve(bordered, np.pad(forces, ((0, 1), (0, 0))))[:-1]
    static = modal_system(rig).transfer(np.zeros(1))[0].real
    displacements = [0] + [1 + i for i, sensor in enumerate(rig.sensors.values()) if sensor.quantity == "displacement"]
    exact = (np.vstack([parts.meshes.T, parts.sensors]) @ q)[displacements]
    assert_allclose(static[displacements], exact, rtol=1e-7, atol=1e-17)
