"""Verification: friction of a tooth, its geometry from rigid-body velocities and its part in the periodic response."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics import prepare_periodic
from sigdb.dynamics.periodic.influences import Influences
from sigdb.transmission import ToothDamage, load_transmission
from sigdb.transmission.system.assembly import assemble

PAIRS = {
    "spur": ("spur-test-rig", {}),
    "helical": ("spur-test-rig", {"helix_angle_deg": 20.0}),
    "helical-left": ("spur-test-rig", {"helix_angle_deg": 20.0, "hand": "left"}),
    "spiral-bevel": ("nasa-spiral-bevel", {}),
}


def described(name, rotation=1):
    filed, changes = PAIRS[name]
    rig = load_transmission(filed)
    data = rig.model_dump()
    mesh = next(iter(data["meshes"]))
    if changes:
        profile = {"contact_ratio": 1.6, "flank": 0.2}  # the energy method is for spur teeth
        data["meshes"][mesh] |= changes | {"stiffness": 2e8, "profile": profile}
    data["operating"]["rotation"] = rotation
    return type(rig).model_validate(data), mesh


def velocities(rig, mesh):
    """Angular velocities of both gears, in the casing's frame."""
    gears = (rig.gears[rig.meshes[mesh].driving], rig.gears[rig.meshes[mesh].driven])
    return [rig.speed(gear.shaft) * rig.shafts[gear.shaft].rotation[:, 2] for gear in gears]


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("name", PAIRS)
def test_teeth_slide_as_the_rigid_gears_do_at_the_contact(name, rotation):
    """At ``xi`` behind the pitch point v1 - v2 lies along the sliding direction, before it against it."""
    rig, mesh = described(name, rotation)
    geometry, (w1, w2) = rig.geometries[mesh], velocities(rig, mesh)
    n, t, (r1, r2) = geometry.normal, geometry.sliding, geometry.arms
    assert_allclose(np.cross(w1, r1), np.cross(w2, r2), atol=1e-9 * np.linalg.norm(w1))
    assert_allclose([n @ t, t @ t], [0, 1], atol=1e-12)
    for xi in (1e-3, -1e-3):
        slip = np.cross(w1, r1 + xi * geometry.path) - np.cross(w2, r2 + xi * geometry.path)
        assert_allclose(slip / np.linalg.norm(slip), np.sign(xi) * t, atol=1e-9)
    if name == "spur":
        assert_allclose(t @ rig.shafts[rig.gears[rig.meshes[mesh].driving].shaft].rotation[:, 2], 0, atol=1e-12)


@pytest.mark.parametrize("name", ["spur", "helical"])
def test_a_section_of_the_teeth_meets_along_the_transverse_line_of_action(name):
    """A transverse base pitch, ``pi m_t cos(alpha_t)``, in a tooth pass, across the shafts."""
    rig, mesh = described(name)
    pair, geometry = rig.meshes[mesh], rig.geometries[mesh]
    alpha_n, beta = np.deg2rad([pair.pressure_angle_deg, pair.helix_angle_deg])
    alpha_t = np.arctan(np.tan(alpha_n) / np.cos(beta))
    way = geometry.base_pitch * geometry.path
    assert_allclose(np.linalg.norm(way), np.pi * pair.module * np.cos(alpha_t), rtol=1e-12)
    assert_allclose(way @ rig.shafts[rig.gears[pair.driving].shaft].rotation[:, 2], 0, atol=1e-15)
    assert_allclose(geometry.path @ geometry.normal, 1, rtol=1e-12)


@pytest.mark.parametrize("rotation", [1, -1])
@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("xi", [-2e-3, 3e-3])
def test_friction_takes_its_power_from_the_rotation(name, rotation, xi):
    """``mu N |v1 - v2|`` at the contact, ``mu N |xi| |(w1 - w2) x path|``: for a spur pair that is |w1 - w2| itself."""
    rig, mesh = described(name, rotation)
    geometry, (w1, w2) = rig.geometries[mesh], velocities(rig, mesh)
    f0, f1 = geometry.friction
    force = -0.1 * 500.0 * (np.sign(xi) * f0 + abs(xi) * f1)
    power = force @ np.concatenate([np.zeros(3), w1, np.zeros(3), w2])
    expected = 0.1 * 500.0 * abs(xi) * np.linalg.norm(np.cross(w1 - w2, geometry.path))
    assert_allclose(power, -expected, rtol=1e-9)
    if name == "spur":
        assert_allclose(expected, 50.0 * abs(xi) * np.linalg.norm(w1 - w2), rtol=1e-9)
    # Action and reaction: no resultant force, and no moment about any one point.
    assert_allclose(force[:3] + force[6:9], 0, atol=1e-12)
    r1, r2 = geometry.arms
    about_contact = [force[3:6] - np.cross(r1 + xi * geometry.path, force[:3])]
    about_contact += [force[9:] - np.cross(r2 + xi * geometry.path, force[6:9])]
    assert_allclose(about_contact, 0, atol=1e-12 * np.abs(force).max())


def test_the_assembled_train_loses_the_same_power_in_its_free_rotation():
    rig, mesh = described("spiral-bevel")
    parts, geometry, (w1, w2) = assemble(rig), rig.geometries[mesh], velocities(rig, mesh)
    speed = max(np.linalg.norm(w1), np.linalg.norm(w2))
    taken = np.abs(parts.friction.T @ parts.free_rotation) * speed
    slip = np.linalg.norm(np.cross(w1 - w2, geometry.path))
    assert_allclose(taken, [0, slip], atol=1e-9 * slip)


@pytest.fixture(scope="module")
def prepared():
    return prepare_periodic(load_transmission("nasa-spiral-bevel"), samples_per_tooth=32)


def test_no_friction_changes_nothing(prepared):
    one = ToothDamage(stiffness_loss=0.4, phase_shift_deg=1.0)
    with_zero = prepared.steady_state([{3: one.model_copy(update={"friction": 0.0})}])[0]
    assert_allclose(with_zero.signals, prepared.steady_state([{3: one}])[0].signals, rtol=0, atol=0)
    nearly = prepared.steady_state([{3: one.model_copy(update={"friction": 1e-9})}])[0]
    scale = np.ptp(with_zero.signals, axis=1)[:, None]
    assert 0 < np.abs((nearly.signals - with_zero.signals) / scale).max() < 1e-7


def test_little_friction_acts_in_proportion_and_more_to_the_second_order(prepared):
    """The change by mu is mu a + mu^2 b: what is left of 2 x(mu) - x(2 mu) falls by four with mu halved."""
    plain = prepared.steady_state([{3: ToothDamage(stiffness_loss=0.3)}])[0].signals

    def change(mu):
        return prepared.steady_state([{3: ToothDamage(stiffness_loss=0.3, friction=mu)}])[0].signals - plain

    left = [np.abs(2 * change(mu) - change(2 * mu)).max() for mu in (0.04, 0.02, 0.01)]
    assert_allclose(np.log2(np.array(left[:-1]) / left[1:]), 2, atol=0.1)
    assert left[-1] < 1e-2 * np.abs(change(0.01)).max()


def test_friction_against_the_sliding_is_friction_the_other_way_round(prepared):
    """With both friction vectors turned round, mu acts as -mu: to first order the changes cancel."""
    transfer = prepared.solver.transfer.copy()
    transfer[:, :, 1:] *= -1
    solver = replace(prepared.solver, transfer=transfer)
    influences = Influences(solver, len(prepared.meshes), prepared.period)
    other = replace(prepared, solver=solver, influences=influences)
    plain = prepared.steady_state([{}])[0].signals
    one = {5: ToothDamage(friction=1e-3)}
    forth, back = (rig.steady_state([one])[0].signals - plain for rig in (prepared, other))
    assert np.abs(forth + back).max() < 2e-3 * np.abs(forth).max()


def test_friction_excites_where_its_tooth_meshes(prepared):
    """Causality within the revolution: the compression departs from the healthy one in pass 6 or the next."""
    healthy = prepared.steady_state([{}])[0]
    rubbing = prepared.steady_state([{6: ToothDamage(friction=0.1)}])[0]
    change = np.abs(rubbing.compression - healthy.compression).reshape(12, 32).max(axis=1)
    assert change.argmax() in (5, 6)
    assert change[4] < 0.35 * change.max()
