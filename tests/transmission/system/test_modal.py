"""Unit: identities of the modal system, its truncation, and the coupled modes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from sigdb.transmission import Transmission, coupled_modes, load_transmission, modal_system
from sigdb.transmission.system.assembly import assemble

OMEGA = 2 * np.pi * np.array([50.0, 240.0, 1000.0, 2000.0, 2880.0, 3500.0, 5760.0, 8640.0])


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def system(rig):
    return modal_system(rig)


def worst(approximate, exact):
    """Greatest error of each transfer over frequency, relative to that transfer's greatest value."""
    return (np.abs(approximate - exact).max(axis=0) / np.abs(exact).max(axis=0)).max()


def on_rigid_ground(rig, **changes):
    """The rig with its bearings in rigid ground and its sensors on the pinion."""
    data = rig.model_dump()
    data["casing"] = {}
    for bearing in data["bearings"].values():
        bearing["seat"] = None
    del data["sensors"]["pinion-housing-vertical"]
    return Transmission.model_validate(data).replace(changes)


def test_static_compression_is_force_over_mean_stiffness(rig, system):
    """G(0) = 1 / kbar, and under the torque W / kbar with W = T / (r cos(phi) cos(psi)), whatever else is soft."""
    static = system.transfer(np.array([0.0]))[0].real
    radius = 81.043e-3 * np.sin(np.arctan(1 / 3))
    force = 356.05 / (radius * np.cos(np.deg2rad(22.5)) * np.cos(np.deg2rad(35)))
    assert_allclose(static[0, 0], 1 / 2.2e8, rtol=1e-8)
    assert_allclose(static[0, 1], force / 2.2e8, rtol=1e-5)


def test_velocity_and_acceleration_are_zero_at_rest(system):
    static = system.transfer(np.array([0.0]))[0]
    scale = np.abs(system.transfer(OMEGA)).max(axis=0)
    assert_allclose(static[1:] / scale[1:], 0, atol=1e-8)


def test_poles_are_conjugate_pairs_with_conjugate_vectors_and_all_are_stable(system):
    upper = np.flatnonzero(system.poles.imag > 0)
    lower = [int(np.argmin(abs(system.poles - system.poles[i].conj()))) for i in upper]
    real = np.flatnonzero(system.poles.imag == 0)
    assert sorted([*upper, *lower, *real]) == list(range(len(system.poles)))
    assert_allclose(system.poles[lower], system.poles[upper].conj(), rtol=1e-9)
    products = system.outputs[:, :, None] * system.inputs
    scale = np.abs(products).max(axis=1, keepdims=True)
    assert_allclose(products[:, lower] / scale, products[:, upper].conj() / scale, atol=1e-7)
    assert system.poles.real.max() < 0


def test_the_free_rotation_is_left_out(rig, system):
    """Two poles fewer than the state has, and none near zero."""
    n = len(assemble(rig).mass)
    assert len(system.poles) == 2 * (n - 1)
    assert np.abs(system.poles).min() > 2 * np.pi * 50


def test_response_is_real_for_real_forces(system):
    there, back = system.transfer(OMEGA), system.transfer(-OMEGA).conj()
    assert worst(back, there) < 1e-8


def test_names_follow_the_rig(system):
    assert system.meshes == ("main",)
    assert system.sensors == ("pinion-vertical", "pinion-housing-vertical")
    assert system.outputs.shape[0] == 3
    assert system.unbalanced == ()
    assert system.inputs.shape[1] == 5
    assert_allclose(system.mesh_stiffness, [2.2e8])


def test_a_slowly_turning_rig_without_casing_has_its_damping_ratio_in_every_mode(rig):
    still = on_rigid_ground(rig, **{"operating.speed_rpm": 1e-3, "damping_ratio": 0.037})
    modes = coupled_modes(still)
    assert_allclose(modes.damping_ratio, 0.037, rtol=1e-6)


SEATS = ("pinion-front", "pinion-rear", "gear-left", "gear-right")
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize(("frequency", "ratio", "mass"), [(15.0, 0.02, 70.0), (6.0, 0.1, 20.0), (20.0, 0.0, 500.0)])
def test_rotors_ride_along_on_soft_mounts_without_damping_of_their_own(rig, frequency, ratio, mass):
    """Mass on a spring and a damper: with the rotors' mass on top both fall with the root of the mass."""
    data = rig.model_dump()
    body = {"frequency_hz": frequency, "damping_ratio": ratio, "modal_mass": mass}
    data["casing"]["modes"] = [{**body, "shape": dict.fromkeys(SEATS, axis)} for axis in AXES]
    mounted = Transmission.model_validate(data)
    modes, parts = coupled_modes(mounted), assemble(mounted)
    along = np.zeros(len(parts.mass))
    for name, dofs in parts.rotors.items():
        along[dofs[: 6 * rig.shafts[name].nodes]] = np.tile([0, 1, 0, 0, 0, 0], rig.shafts[name].nodes)
    less = np.sqrt(mass / (mass + along @ parts.mass @ along))
    assert_allclose(modes.frequency_hz[:3], frequency * less * np.sqrt(1 - (ratio * less) ** 2), rtol=0.005)
    assert_allclose(modes.damping_ratio[:3], ratio * less, rtol=0.01, atol=1e-4)
    assert all(moves["casing"] > 0.98 * less**2 for moves in modes.moves[:3])


def test_its_frequencies_are_those_of_the_assembled_matrices(rig):
    still = on_rigid_ground(rig, **{"operating.speed_rpm": 1e-3, "damping_ratio": 0.0})
    parts = assemble(still)
    k = parts.stiffness + 2.2e8 * parts.meshes @ parts.meshes.T
    squares = eigh(k, parts.mass, eigvals_only=True)[1:]
    assert_allclose(coupled_modes(still).frequency_hz, np.sqrt(squares) / (2 * np.pi), rtol=1e-6)


def test_shares_of_kinetic_energy_add_to_one_greatest_first(rig):
    modes = coupled_modes(rig)
    undamped = modes.frequency_hz / np.sqrt(1 - modes.damping_ratio**2)
    assert (np.diff(undamped) >= -1e-6).all()
    for moves in modes.moves:
        shares = list(moves.values())
        assert_allclose(sum(shares), 1, rtol=1e-12)
        assert shares == sorted(shares, reverse=True)
        assert min(shares) >= 0


def test_modes_are_named_by_what_moves(rig):
    """A very heavy casing on its own spring hardly feels the rotors: its three modes stay at their frequencies."""
    heavy = rig.replace({f"casing.modes.{i}.modal_mass": 1e7 for i in range(3)})
    modes = coupled_modes(heavy)
    casing = [i for i, moves in enumerate(modes.moves) if next(iter(moves)) == "casing"]
    assert_allclose(np.sort(modes.frequency_hz[casing]), [1850, 2530, 4100], rtol=1e-3)
    assert_allclose(modes.damping_ratio[casing], 0.03, rtol=1e-2)
    assert all(modes.moves[i]["casing"] > 0.98 for i in casing)


def test_another_frame_of_the_casing_gives_the_same_response(rig, system):
    """Shafts, casing shapes and sensors turned together; bearings are alike across their shafts."""
    turn = Rotation.from_rotvec([0.5, -0.9, 0.3]).as_matrix()
    data = rig.model_dump()
    for shaft in data["shafts"].values():
        shaft["axis"] = tuple(turn @ shaft["axis"])
    for mode in data["casing"]["modes"]:
        mode["shape"] = {point: tuple(turn @ shape) for point, shape in mode["shape"].items()}
    for sensor in data["sensors"].values():
        sensor["direction"] = tuple(turn @ sensor["direction"])
    turned = modal_system(Transmission.model_validate(data))
    assert worst(turned.transfer(OMEGA), system.transfer(OMEGA)) < 1e-8


def test_a_mirrored_description_of_a_shaft_gives_the_same_response(rig, system):
    """The gear's shaft numbered from its other end: axis, nodes, apex and nothing else."""
    data = rig.model_dump()
    data["shafts"]["gear-shaft"]["axis"] = (-1.0, 0.0, 0.0)
    data["gears"]["gear"]["apex"] = "ahead"
    for part in (
        data["gears"]["gear"],
        data["bearings"]["gear-left"],
        data["bearings"]["gear-right"],
        data["couplings"]["brake"],
    ):
        part["node"] = 8 - part["node"]
    assert worst(modal_system(Transmission.model_validate(data)).transfer(OMEGA), system.transfer(OMEGA)) < 1e-8


def test_component_modes_converge_to_the_full_model(rig, system):
    """Equations (5), (6): up to three times the mesh frequency, over all outputs and inputs."""
    exact = system.transfer(OMEGA)
    errors = [worst(modal_system(rig, component_modes=count).transfer(OMEGA), exact) for count in (4, 12, 32, 40, 54)]
    assert (np.array(errors) < [0.5, 0.06, 4e-3, 1e-4, 1e-8]).all()


@pytest.mark.parametrize("count", [0, 1, 4])
def test_component_modes_keep_the_static_response(rig, count):
    """Attachment modes: static displacement under mesh force and torque is exact with hardly any mode."""
    data = rig.model_dump()
    for sensor in data["sensors"].values():
        sensor["quantity"] = "displacement"
    displaced = Transmission.model_validate(data)
    full, few = (modal_system(displaced, component_modes=n) for n in (None, count))
    assert len(few.poles) < len(full.poles) / 2
    exact = full.transfer(np.zeros(1))[0, :, :3]
    # A free train answers a force along its mesh with compression alone, so that the sensors stay at rest.
    assert_allclose(exact[1:, 0] * 1e4, 0, atol=1e-12)
    error = np.abs(few.transfer(np.zeros(1))[0, :, :3] - exact)
    assert (error < 1e-8 * np.abs(exact) + [[1e-16, 0, 0]]).all()


def test_truncation_keeps_that_many_pairs_and_the_static_response(system):
    for count in (4, 16, 48):
        few = system.truncated(count)
        assert len(few.poles) == 2 * count
        assert_allclose(few.transfer(np.array([0.0]))[0, 0], system.transfer(np.array([0.0]))[0, 0], rtol=1e-9)


def test_truncation_converges_to_the_full_system(system):
    """By their part in all but friction, which needs more of them."""
    exact = system.transfer(OMEGA)[:, :, :3]
    errors = [worst(system.truncated(count).transfer(OMEGA)[:, :, :3], exact) for count in (16, 32, 48, 64, 90, 112)]
    assert (np.array(errors) < [0.2, 0.02, 2e-3, 5e-4, 2e-6, 1e-12]).all()


def test_truncation_by_taking_part_is_better_than_the_lowest_modes(system):
    """The same number of modes, each set with its residual flexibility: the lowest ones serve the mesh far worse."""
    exact = system.transfer(OMEGA)[:, 0, 0]
    count = 32
    lowest = np.argsort(np.abs(system.poles), kind="stable")[: 2 * count]
    rest = np.setdiff1d(np.arange(len(system.poles)), lowest)
    c, b = system.outputs[0], system.inputs[:, 0]
    residual = (c[rest] * b[rest] / -system.poles[rest]).sum().real
    by_order = (c[lowest] * b[lowest] / (1j * OMEGA[:, None] - system.poles[lowest])).sum(axis=1) + residual
    by_share = system.truncated(count).transfer(OMEGA)[:, 0, 0]
    assert np.abs(by_share - exact).max() < 0.5 * np.abs(by_order - exact).max()
