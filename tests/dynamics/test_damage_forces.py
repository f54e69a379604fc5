"""Verification: damage as displacement, in slow motion against the closed form of loaded teeth, and by both solvers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.dynamics import Transient, prepare_periodic
from sigdb.dynamics.damage_forces import damage_change
from sigdb.transmission import ToothDamage, Transmission, load_transmission
from sigdb.transmission.mesh.energy_method import pair_curve
from sigdb.transmission.mesh.stiffness import (
    damaged_pair_deviation,
    damaged_pair_stiffness,
    place_in_contact,
    tooth_stiffness,
)

TEETH, TOOTH = 12, 6
SLOW = {"operating.speed_rpm": 5.0}


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def prepared(rig):
    return prepare_periodic(rig)


def deviation_of(mesh, damage, samples):
    """Stiffness (teeth, n) of the pairs and the deviation (n,) of the damaged one over a revolution."""
    u = np.arange(samples * TEETH) / samples
    stiffness = tooth_stiffness(mesh, TEETH, u, {TOOTH: damage})
    return stiffness, damaged_pair_deviation(mesh.profile, place_in_contact(u, TEETH)[TOOTH - 1], damage, TEETH)


@pytest.mark.parametrize(
    "damage",
    [
        ToothDamage(flank_deviation=2e-5),
        ToothDamage(flank_deviation=-2e-5, deviation_extent=0.5),
        ToothDamage(flank_deviation=3e-5, deviation_extent=0.4, deviation_place=0.3, stiffness_loss=0.2),
    ],
)
def test_in_slow_motion_the_loaded_teeth_are_where_their_forces_balance_the_torque(rig, damage):
    """``F = sum_j k_j (delta - e_j)``: the compression is ``(F + k e) / sum_j k_j`` at every instant."""
    slow = prepare_periodic(rig.replace(SLOW))
    state = slow.steady_state([{TOOTH: damage}])[0]
    stiffness, deviation = deviation_of(rig.meshes["main"], damage, slow.samples_per_tooth)
    expected = (state.static_force + stiffness[TOOTH - 1] * deviation) / stiffness.sum(axis=0)
    assert_allclose(state.compression, expected, rtol=0, atol=2e-4 * state.static_compression)


@pytest.mark.parametrize(("depth", "extent"), [(1e-4, 0.2), (5e-6, 1.0)])
def test_a_rigid_pair_moves_by_its_deviation_where_it_is_alone_and_not_where_others_carry(rig, depth, extent):
    """Under a hundredth of the torque the mesh yields by 0.8 um, as rigid ones do: what is left is the deviation."""
    rigid = prepare_periodic(rig.replace(SLOW | {"operating.torque": 3.56}))
    damage = ToothDamage(flank_deviation=depth, deviation_extent=extent)
    state = rigid.steady_state([{TOOTH: damage}])[0]
    stiffness, deviation = deviation_of(rig.meshes["main"], damage, rigid.samples_per_tooth)
    of_others = np.delete(stiffness, TOOTH - 1, axis=0).sum(axis=0)
    alone = (of_others == 0) & ((deviation == 0) | (deviation == depth))
    assert alone.sum() > 5
    assert_allclose(state.compression[alone], deviation[alone], atol=2 * state.static_compression)
    shared = of_others > 0.5 * rig.meshes["main"].stiffness
    assert_allclose(state.compression[shared], 0, atol=2 * state.static_compression)


@pytest.mark.parametrize(
    ("damage", "parts"),
    [
        (ToothDamage(flank_deviation=4e-5, deviation_extent=0.3), False),
        (ToothDamage(flank_deviation=-1e-5, phase_shift_deg=1.0, friction=0.1), False),
        (ToothDamage(flank_deviation=1.2e-4), True),
    ],
)
def test_the_march_agrees_with_the_periodic_solution_while_the_teeth_touch(rig, prepared, damage, parts):
    state = prepared.steady_state([{TOOTH: damage}])[0]
    marched = Transient().prepare(rig, "pinion").steady_state([{TOOTH: damage}])[0]
    assert bool(state.contact_loss) is bool(marched.contact_loss) is parts
    away = (np.abs(state.signals - marched.signals).max(axis=1) / np.ptp(marched.signals, axis=1)).max()
    assert (away < 1.5 * (state.error + marched.error)) is not parts


def test_teeth_that_are_worn_alike_move_the_gear_and_nothing_else(prepared):
    healthy, worn = prepared.steady_state(
        [{}, dict.fromkeys(range(1, 13), ToothDamage(flank_deviation=2e-4))]
    ).compression
    assert_allclose(worn - healthy, 2e-4, atol=1e-3 * 2e-4)


def test_a_deviation_is_no_lost_stiffness_until_it_is_deeper_than_the_mesh_yields(rig):
    def change(depth, force):
        kind = ToothDamage(flank_deviation=depth)
        return damage_change(rig.meshes["main"], "pinion", TEETH, 0.015, {TOOTH: kind}, 64, force)

    shallow, deep = change(1e-5, 18e3), change(5e-4, 18e3)
    assert_array_equal(shallow.stiffness, 0)
    assert shallow.profile.max() > 0
    assert_allclose(shallow.profile, change(2e-5, 36e3).profile / 2)
    assert deep.stiffness.max() <= 0
    assert deep.stiffness.min() < 0


def test_a_proud_tooth_takes_the_load_off_its_sound_neighbours(rig):
    kind = ToothDamage(flank_deviation=-5e-4)
    change = damage_change(rig.meshes["main"], "pinion", TEETH, 0.015, {TOOTH: kind}, 64, 18e3)
    passes = np.unique(change.samples[change.stiffness[0] < 0] // 64)
    assert set(passes) == {TOOTH - 1, TOOTH}
    assert_array_equal(change.errors[TOOTH], 0)
    assert max(change.errors[tooth].min() for tooth in (TOOTH - 1, TOOTH + 1)) < 0


def test_a_proud_tooth_takes_the_load_off_all_that_it_shares_a_long_contact_with():
    """In a contact of more than four passes these are four teeth on each side."""
    profile = {"kind": "iso-6336", "flank": 0.2}
    data = load_transmission("spur-test-rig").model_dump()
    data["meshes"]["main"] |= {"profile": profile, "face_width": 0.08, "helix_angle_deg": 20.0}
    mesh = Transmission.model_validate(data).meshes["main"]
    assert 4 < mesh.profile.contact_ratio < 5
    change = damage_change(mesh, "pinion", 19, 0.01, {9: ToothDamage(flank_deviation=-5e-4)}, 64, 1e3)
    relieved = {tooth for tooth, error in change.errors.items() if error.min() < 0}
    assert relieved == {5, 6, 7, 8, 10, 11, 12, 13}


def test_a_missing_tooth_lets_the_gear_fall_onto_the_corners_of_its_neighbours():
    """Half a base pitch less half the contact from each corner both gaps are equal, and no tooth is nearer.

    On equal gears ``e = (rho / r_b)^2 L / (rho (L - rho)) y^2 / 2`` for the way y from each corner.
    """
    rig = load_transmission("spur-test-rig").replace({"wheel.teeth": 19})
    profile, missing = rig.meshes["main"].profile, ToothDamage(chip_height=8e-3)
    middle = np.array([profile.contact_ratio / 2])
    pair = profile.pair
    rho, length = pair.line_of_action - pair.first_contact, pair.line_of_action
    way = (1 - pair.contact_ratio / 2) * pair.base_pitch
    gap = (rho / pair.base_radii[0]) ** 2 * length / (rho * (length - rho)) * way**2 / 2
    assert_allclose(damaged_pair_deviation(profile, middle, missing, 19, driving=True), gap, rtol=1e-9)
    stiffness = damaged_pair_stiffness(profile, middle, missing, 19, driving=True)
    assert_allclose(stiffness, pair_curve(profile.elastic)[0] / profile.mean_stiffness, rtol=2e-3)
