"""Verification: contact by the mesh force, in closed form at crawling speed, by Runge-Kutta where teeth part."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from sigdb.dynamics import (
    ContactLossWarning,
    MarchErrorWarning,
    Periodic,
    Transient,
    prepare_periodic,
    settle,
    simulate,
)
from sigdb.transmission import Damage, ToothDamage, Transmission, load_transmission

TEETH, MODULE, PRESSURE, CONTACT, FLANK, MEAN, TORQUE = 10, 0.004, 20.0, 1.6, 0.2, 2.0e7, 50.0
ROTORS = ((0.8, 2e-4, 4e-3), (1.0, 3e-4, 5e-3))
"""Mass and polar inertia of each gear, and inertia of its machine."""
COUPLING, SEAT, RATIO = 4e3, 3e7, 0.12
BASE = MODULE * TEETH / 2 * np.cos(np.deg2rad(PRESSURE))
FORCE = TORQUE / BASE


def pair(speed_rpm, **mesh):
    """Two equal gears that turn; the driving one also moves across the line of centres."""
    names = ("small", "large")
    return Transmission(
        name="pair",
        damping_ratio=RATIO,
        operating={"drive": "motor", "load": "brake", "speed_rpm": speed_rpm, "torque": TORQUE},
        shafts={
            "in": {"axis": [0.0, 0.0, 1.0], "motions": ["x", "rz"]},
            "out": {"axis": [0.0, 0.0, 1.0], "motions": ["rz"]},
        },
        gears={
            name: {"shaft": shaft, "node": 0, "teeth": TEETH, "mass": mass, "polar_inertia": inertia}
            for name, shaft, (mass, inertia, _) in zip(names, ("in", "out"), ROTORS, strict=True)
        },
        meshes={
            "main": {
                "driving": "small",
                "driven": "large",
                "module": MODULE,
                "face_width": 0.02,
                "pressure_angle_deg": PRESSURE,
                "line_of_centres": [0.0, 1.0, 0.0],
                "stiffness": MEAN,
                "profile": {"contact_ratio": CONTACT, "flank": FLANK},
                **mesh,
            }
        },
        couplings={
            "motor": {"shaft": "in", "node": 0, "stiffness": COUPLING, "inertia": ROTORS[0][2]},
            "brake": {"shaft": "out", "node": 0, "stiffness": COUPLING, "inertia": ROTORS[1][2]},
        },
        bearings={"seat": {"shaft": "in", "node": 0, "stiffness": [SEAT, 0.0, 0.0], "damping": [0.0, 0.0, 0.0]}},
        sensors={"across": {"gear": "small", "direction": [1.0, 0.0, 0.0], "quantity": "displacement"}},
    )


def step(x):
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(x, 0.0, 1.0))


def pair_stiffnesses(u):
    """(teeth, ...) stiffness of each tooth's pair at u passes of the driving gear."""
    x = (np.asarray(u) - np.arange(TEETH).reshape(-1, *[1] * np.ndim(u)) + 2.0) % TEETH - 2.0
    return MEAN * step(x / FLANK) * step((CONTACT - x) / FLANK) / (CONTACT - FLANK)


STATIC = FORCE / MEAN
ERRORS = {
    "every second tooth early": np.where(np.arange(TEETH) % 2, -2 * STATIC, 0.0),
    "one tooth late": np.where(np.arange(TEETH) == 3, 5 * STATIC, 0.0),
    "any": np.random.default_rng(5).normal(0, 3 * STATIC, TEETH),
}


@pytest.mark.parametrize("errors", ERRORS.values(), ids=ERRORS)
@pytest.mark.parametrize("solver", [Periodic(), Transient()])
def test_at_crawling_speed_errors_of_teeth_bend_the_gears_and_lose_nothing(errors, solver):
    """The torque is the mesh force at every instant: ``delta = (F + sum k_j e_j) / sum k_j``, also below zero."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        response = simulate(pair(0.01), index_errors=errors, solver=solver)
    k = pair_stiffnesses(np.arange(TEETH * 64) / 64)
    compression = (FORCE + errors @ k) / k.sum(axis=0)
    assert_allclose(response.compression, compression, rtol=0, atol=2e-3 * np.ptp(compression))
    assert_allclose(response.mesh_force, FORCE, rtol=5e-3)
    assert response.min_mesh_force == pytest.approx(1, abs=5e-3)
    assert response.min_compression == pytest.approx(
        compression.min() / STATIC, abs=5e-3 * np.ptp(compression) / STATIC
    )
    assert not response.contact_loss


def test_the_force_of_profile_errors_and_of_runout_is_subtracted_too():
    relief, runout = 3 * STATIC, 4 * STATIC
    rig = pair(0.01, profile_error={"amplitude": relief}).replace({"small.runout": runout})
    response = simulate(rig)
    assert response.min_compression < 0 < response.min_mesh_force
    assert_allclose(response.mesh_force, FORCE, rtol=5e-3)
    prepared = prepare_periodic(rig)
    assert not prepared.steady_state([{}])[0].contact_loss


def test_a_mesh_whose_force_is_negative_is_open():
    """Faster, the inertia of the gears cannot follow the same errors."""
    response = simulate(pair(0.01), index_errors=ERRORS["any"])
    with pytest.warns(ContactLossWarning, match="least mesh force -"):
        fast = simulate(pair(6000.0), index_errors=ERRORS["any"])
    assert not response.contact_loss
    assert fast.contact_loss
    assert fast.min_mesh_force < 0


def test_both_solvers_agree_on_the_contact_of_every_mesh_of_a_train():
    """Errors of 3 um and a weak tooth: the compression of nominal teeth is below zero, no mesh force is."""
    rig, damage = load_transmission("two-stage-gearbox"), {3: ToothDamage(stiffness_loss=0.3)}
    prepared = prepare_periodic(rig, samples_per_tooth=16)
    errors = 3e-6 * np.random.default_rng(0).standard_normal(prepared.teeth)
    state = prepared.steady_state([damage])[0]
    coarse = Transient(samples_per_tooth=16, steps_per_tooth=64, tolerance=1e-3, accuracy=0.1)
    start = prepared.modal_state(damage, errors)
    orbit = settle(
        rig, gear=prepared.gear, damage=damage, index_errors=errors, state=start, solver=coarse, system=prepared.system
    )
    assert state.least_compression_at(errors) < 0
    assert not state.contact_loss_at(errors)
    assert not orbit.contact_loss
    assert state.least_mesh_force_at(errors) == pytest.approx(orbit.min_mesh_force, abs=0.03)
    elsewhere = state.force_elsewhere[0] + state.force_elsewhere_response[0] @ errors
    marched = orbit.mesh_force[1] / orbit.static_force[1]
    assert_allclose(elsewhere, marched, rtol=0, atol=0.05 * np.ptp(marched))
    assert np.abs(state.force_elsewhere_response[0] @ errors).max() > 0.1 * np.ptp(marched)


def reference(second_order, speed_rpm, loss, revolutions):
    """(n,) displacement of the driving gear across the line of centres over the last revolution, 64 samples a tooth.

    Degrees of freedom: motor, driving gear, its displacement, driven gear, brake. Tooth 4 loses a part of its
    stiffness, and a mesh does not pull.
    """
    (mass, j1, motor), (_, j2, brake) = ROTORS
    inertia = np.array([motor, j1, mass, j2, brake])
    h = np.array([0.0, BASE, -np.cos(np.deg2rad(PRESSURE)), BASE, 0.0])
    springs = np.zeros((5, 5))
    for i, j in ((0, 1), (3, 4)):
        springs[np.ix_([i, j], [i, j])] += COUPLING * np.array([[1, -1], [-1, 1]])
    springs[2, 2] = SEAT
    squares, modes = eigh(springs + MEAN * np.outer(h, h), np.diag(inertia))
    weighted = inertia[:, None] * modes
    damping = weighted @ np.diag(2 * RATIO * np.sqrt(squares.clip(min=0.0))) @ weighted.T
    torque = np.array([TORQUE, 0.0, 0.0, 0.0, TORQUE])
    state = np.concatenate([np.linalg.lstsq(springs + MEAN * np.outer(h, h), torque, rcond=1e-12)[0], np.zeros(5)])
    steps = 2048 * TEETH
    k = pair_stiffnesses(np.arange(2 * steps + 1) / 4096)
    k[3] *= 1 - loss
    for _ in range(revolutions):
        across, *_, state = second_order(
            -np.hstack([springs, damping]) / inertia[:, None],
            (h / inertia)[:, None],
            h[None],
            gain=k.sum(axis=0)[:, None],
            late=np.zeros((2 * steps + 1, 1)),
            external=np.tile(torque / inertia, (2 * steps + 1, 1)),
            state=state,
            step=60 / speed_rpm / steps,
            samples=64 * TEETH,
            backlash=1e3,
        )
    return across[2]


@pytest.mark.parametrize(("speed_rpm", "loss", "revolutions"), [(900.0, 1.0, 4), (6000.0, 0.95, 20)])
def test_a_march_with_impacts_meets_the_error_that_it_states(second_order, speed_rpm, loss, revolutions):
    """Also from steps that are far too long: they are halved until the accuracy is met."""
    expected = reference(second_order, speed_rpm, loss, revolutions)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        damage, coarse = Damage(tooth=4, stiffness_loss=loss), Transient(samples_per_tooth=64, steps_per_tooth=256)
        found = simulate(pair(speed_rpm), damage, solver=coarse)
    assert found.contact_loss
    assert found.error <= 2e-4
    assert np.abs(found.signal("across") - expected).max() < 2e-4 * np.ptp(expected)


def test_a_march_that_cannot_meet_its_accuracy_says_so():
    solver = Transient(samples_per_tooth=16, steps_per_tooth=64, most_steps_per_tooth=128, accuracy=1e-9)
    with pytest.warns(MarchErrorWarning, match="does not meet its accuracy: its error is .* most_steps_per_tooth"):
        response = simulate(pair(900.0), Damage(tooth=4, stiffness_loss=1.0), solver=solver)
    assert response.error > 1e-9
