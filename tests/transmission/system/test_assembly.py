"""Unit: identities of the assembled equations of the NASA rig, and parts of them worked out by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission import load_transmission
from sigdb.transmission.system.assembly import assemble

PINION_NODES, GEAR_NODES = range(9), range(9, 18)
MOTOR, BRAKE = 108, 109
CASING = [110, 111, 112]


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def parts(rig):
    return assemble(rig)


def along(nodes, kind, n=113):
    v = np.zeros(n)
    v[[6 * node + kind for node in nodes]] = 1
    return v


def test_there_are_six_freedoms_a_node_one_a_machine_and_one_a_casing_mode(parts):
    assert parts.mass.shape == (18 * 6 + 2 + 3,) * 2
    assert parts.casing == CASING
    assert sorted(i for dofs in parts.rotors.values() for i in dofs) == list(range(110))
    assert sorted(i for dofs in parts.motions.values() for i in dofs) == list(range(113))


def test_matrices_are_symmetric_and_the_gyroscopic_one_skew(parts):
    for matrix in (parts.mass, parts.stiffness, parts.damping):
        assert_allclose(matrix, matrix.T, rtol=0, atol=1e-12 * abs(matrix).max())
    assert_allclose(parts.gyroscopic, -parts.gyroscopic.T, rtol=0, atol=1e-15)
    assert np.linalg.eigvalsh(parts.mass).min() > 0


@pytest.mark.parametrize(
    ("nodes", "length", "diameter", "gear_mass"),
    [
        (PINION_NODES, 0.280, 0.058, 7800 * np.pi * 0.0256281**2 * 0.038),
        (GEAR_NODES, 0.385, 0.055, 7800 * np.pi * (0.0768843**2 - 0.0275**2) * 0.0245),
    ],
)
@pytest.mark.parametrize("kind", [0, 1, 2])
def test_a_shaft_that_moves_as_a_whole_has_the_mass_of_shaft_and_gear(parts, nodes, length, diameter, gear_mass, kind):
    v = along(nodes, kind)
    assert_allclose(v @ parts.mass @ v, 7800 * np.pi / 4 * diameter**2 * length + gear_mass, rtol=2e-6)


def test_the_free_rotation_has_the_inertia_of_all_that_turns(parts):
    """Shafts m d^2 / 8, gears m (r^2 + b^2) / 2, machines 0.0076 each; the gear's side at a third of the speed."""
    pinion_side = 7800 * np.pi * (0.058**4 / 32 * 0.280 + 0.0256281**4 / 2 * 0.038) + 0.0076
    gear_side = 7800 * np.pi * (0.055**4 / 32 * 0.385 + (0.0768843**4 - 0.0275**4) / 2 * 0.0245) + 0.0076
    turning = parts.free_rotation
    assert_allclose(turning @ parts.mass @ turning, pinion_side + gear_side / 9, rtol=5e-6)


def test_the_free_rotation_strains_nothing_and_dissipates_nothing(parts):
    turning = parts.free_rotation
    assert_allclose(np.abs(turning).max(), 1, rtol=1e-14)
    assert_allclose(parts.stiffness @ turning, 0, atol=1e-12 * abs(parts.stiffness).max())
    assert_allclose((parts.damping + parts.gyroscopic) @ turning, 0, atol=1e-12)
    assert_allclose(parts.meshes.T @ turning, 0, atol=1e-15)


def test_torque_enters_with_the_rotation_leaves_against_it_and_keeps_the_power(parts):
    """356.05 N m at the motor, three times as much at the brake."""
    assert_allclose(parts.torque @ parts.free_rotation, 0, atol=1e-12)
    assert np.flatnonzero(parts.torque).tolist() == [MOTOR, BRAKE]
    assert_allclose(np.abs(parts.torque[[MOTOR, BRAKE]]), [356.05, 3 * 356.05], rtol=1e-14)
    assert parts.torque[MOTOR] * parts.free_rotation[MOTOR] > 0


def test_the_gyroscopic_moment_of_a_shaft_is_its_polar_inertia_times_its_speed(rig, parts):
    """Id theta_x'' + Ip Omega theta_y' = Mx: the shaft and gear tilted as a whole about a node."""
    polar = 7800 * np.pi * (0.058**4 / 32 * 0.280 + 0.0256281**4 / 2 * 0.038)
    z = np.arange(9) * 0.035
    about_x, about_y = along(PINION_NODES, 3), along(PINION_NODES, 4)
    about_x[[6 * node + 1 for node in PINION_NODES]] = -z
    about_y[[6 * node for node in PINION_NODES]] = z
    signed = -2 * np.pi * 240
    assert_allclose(about_x @ parts.gyroscopic @ about_y, polar * signed, rtol=1e-5)


def test_a_bearing_force_acts_on_the_shaft_and_against_it_on_the_casing(parts):
    """Equation (3): no force where shaft and seat move together; the casing's own modes are springs beside that."""
    together = np.zeros(113)
    together[CASING[0]] = 1.0  # first mode: vertical, 1 at the pinion's front bearing and 0.7 at its rear one
    with_shafts = together.copy()
    slope = (0.7 - 1.0) / (5 * 0.035)
    z = np.arange(9) * 0.035
    with_shafts[[6 * node + 1 for node in PINION_NODES]] = 1.0 + slope * (z - 2 * 0.035)
    with_shafts[[6 * node + 3 for node in PINION_NODES]] = -slope
    with_shafts[[6 * node + 1 for node in GEAR_NODES]] = 0.4
    own = 70.0 * (2 * np.pi * 2530) ** 2
    assert_allclose(with_shafts @ parts.stiffness @ with_shafts, own, rtol=1e-9)
    springs = 1.1e8 * (1 + 0.7**2) + 2 * 1.7e8 * 0.4**2
    assert_allclose(together @ parts.stiffness @ together, own + springs, rtol=1e-12)


def test_casing_modes_have_their_mass_frequency_and_damping(parts):
    omega = 2 * np.pi * np.array([2530.0, 1850.0, 4100.0])
    mass = np.array([70.0, 70.0, 45.0])
    assert_allclose(np.diag(parts.mass)[CASING], mass, rtol=1e-14)
    assert_allclose(np.diag(parts.damping)[CASING], 2 * 0.03 * omega * mass, rtol=1e-12)


def test_sensors_see_the_pinions_centre_and_the_housing_along_their_direction(parts):
    """Vertical is Y: v of the pinion's node 0, and the Y part of each casing shape at its front bearing."""
    expected = np.zeros((2, 113))
    expected[0, 1] = 1.0
    expected[1, CASING] = [1.0, 0.0, 0.6]
    assert_allclose(parts.sensors, expected, atol=1e-15)


def test_bearing_damping_is_viscous_between_shaft_and_seat(rig):
    data = rig.model_dump()
    data["bearings"]["gear-left"]["damping"] = (10.0, 20.0, 30.0)
    more = assemble(type(rig).model_validate(data))
    gained = more.damping - assemble(rig).damping
    node = 6 * 10
    assert_allclose(gained[node, node], 10.0, rtol=1e-12)
    assert_allclose(gained[node + 1, node + 1], 20.0, rtol=1e-12)
    assert_allclose(gained[node + 2, node + 2], 30.0, rtol=1e-12)
    # Vertical motion of the seat in the first casing mode is 0.4 of the mode's.
    assert_allclose(gained[node + 1, CASING[0]], -0.4 * 20.0, rtol=1e-12)
    assert (np.linalg.eigvalsh(gained) > 1e-9).sum() == 3
    assert np.linalg.eigvalsh(gained).min() > -1e-9


def test_tilt_stiffness_holds_both_tilts_and_neither_translation(rig):
    tilted = assemble(rig.replace({"gear-right.tilt_stiffness": 5e4}))
    gained = tilted.stiffness - assemble(rig).stiffness
    node = 6 * 16
    expected = np.zeros_like(gained)
    expected[node + 3, node + 3] = expected[node + 4, node + 4] = 5e4
    assert_allclose(gained, expected, atol=1e-6)
