"""Unit: stiffness of each tooth pair, healthy and damaged, against its law written out here."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import trapezoid

from sigdb.core.errors import InputError
from sigdb.transmission import Damage, ToothDamage
from sigdb.transmission.mesh.stiffness import pair_stiffness, tooth_stiffness
from sigdb.transmission.parts.gears import Mesh, Trapezoid

TEETH = 12
MEAN = 2.2e8


def a_mesh(contact_ratio=1.3, flank=0.45):
    return Mesh(
        driving="a",
        driven="b",
        module=0.005,
        face_width=0.025,
        pressure_angle_deg=20.0,
        stiffness=MEAN,
        profile=Trapezoid(contact_ratio=contact_ratio, flank=flank),
    )


def step(x):
    """0 before 0, 1 after 1, a raised cosine between."""
    return np.where(x <= 0, 0.0, np.where(x >= 1, 1.0, 0.5 - 0.5 * np.cos(np.pi * x)))


def expected_pair(x, contact_ratio=1.3, flank=0.45, shift=0.0, loss=0.0, extent=1.0):
    """kp(x') (1 - l v(x')), x' = x - s w(x), with edges of max(0.1, 1.6 |s|) pass; unit mean of the sum."""
    edge = max(0.1, 1.6 * abs(shift))
    window = step((x + edge) / edge) * step((contact_ratio + edge - x) / edge)
    x = x - shift * window
    profile = np.minimum(step(x / flank), step((contact_ratio - x) / flank)) / (contact_ratio - flank)
    return profile * (1 - loss * step((extent * (contact_ratio + edge) - x) / edge))


def passes(samples=64):
    return np.arange(samples * TEETH) / samples


PROFILES = [(1.0, 0.5), (1.3, 0.45), (1.64, 0.1), (2.5, 0.6)]


@pytest.mark.parametrize(("contact_ratio", "flank"), PROFILES)
def test_the_profiles_area_is_one(contact_ratio, flank):
    x = np.linspace(-0.5, contact_ratio + 0.5, 200001)
    assert_allclose(trapezoid(pair_stiffness(Trapezoid(contact_ratio=contact_ratio, flank=flank), x), x), 1, rtol=1e-8)


@pytest.mark.parametrize(("contact_ratio", "flank"), PROFILES)
def test_the_profile_is_flat_between_its_flanks_and_zero_outside_the_contact(contact_ratio, flank):
    profile = Trapezoid(contact_ratio=contact_ratio, flank=flank)
    plateau = 1 / (contact_ratio - flank)
    assert_array_equal(pair_stiffness(profile, np.array([-0.3, 0.0, contact_ratio, contact_ratio + 0.2])), 0)
    assert_allclose(pair_stiffness(profile, np.array([flank, contact_ratio / 2, contact_ratio - flank])), plateau)
    assert_allclose(pair_stiffness(profile, np.array([flank / 2, contact_ratio - flank / 2])), plateau / 2)


@pytest.mark.parametrize(("contact_ratio", "flank"), PROFILES)
def test_the_healthy_mesh_has_the_stated_mean_and_repeats_every_pass(contact_ratio, flank):
    k = tooth_stiffness(a_mesh(contact_ratio, flank), TEETH, passes(), {}).sum(axis=0)
    assert_allclose(k.mean(), MEAN, rtol=1e-4)
    assert_allclose(k, np.roll(k, 64), rtol=1e-12)


def test_each_tooth_starts_its_contact_one_pass_after_the_one_before_it_and_the_first_at_the_mark():
    rows = tooth_stiffness(a_mesh(), TEETH, passes(), {})
    assert rows.shape == (TEETH, 64 * TEETH)
    x = passes() - 12 * (passes() > 6)
    assert_allclose(rows[0], MEAN * expected_pair(x), rtol=1e-12, atol=1e-6)
    for tooth in range(1, TEETH):
        assert_allclose(rows[tooth], np.roll(rows[0], 64 * tooth), rtol=1e-12, atol=1e-6)


def test_stiffness_wraps_round_the_revolution():
    u = passes()
    assert_allclose(tooth_stiffness(a_mesh(), TEETH, u + TEETH, {}), tooth_stiffness(a_mesh(), TEETH, u, {}), atol=1e-3)


@given(
    tooth=st.integers(1, TEETH),
    shift=st.floats(-0.5, 0.5),
    loss=st.floats(0, 1),
    extent=st.floats(0, 1),
    profile=st.sampled_from(PROFILES),
)
@settings(deadline=None, max_examples=60)
def test_a_damaged_tooth_follows_the_stated_law_and_the_others_stay_as_they_are(tooth, shift, loss, extent, profile):
    damage = ToothDamage(phase_shift_deg=shift * 360 / TEETH, stiffness_loss=loss, loss_extent=extent)
    mesh = a_mesh(*profile)
    healthy, damaged = (tooth_stiffness(mesh, TEETH, passes(), d) for d in ({}, {tooth: damage}))
    x = (passes() - (tooth - 1) + 1.5) % TEETH - 1.5
    expected = MEAN * expected_pair(x, *profile, shift, loss, extent)
    assert_allclose(damaged[tooth - 1], expected, rtol=1e-9, atol=1e-9 * MEAN)
    others = [i for i in range(TEETH) if i != tooth - 1]
    assert_array_equal(damaged[others], healthy[others])


@pytest.mark.parametrize("shift_deg", [-4.5, -1.5, 1.5, 4.5])
def test_a_phase_shift_delays_the_profile_all_along_the_contact(shift_deg):
    """Inside the tooth's contact the window is 1: the damaged profile is the healthy one, shift later."""
    x = np.linspace(0, 1.3, 500)
    s = shift_deg * TEETH / 360
    damaged = tooth_stiffness(a_mesh(), TEETH, x, {1: ToothDamage(phase_shift_deg=shift_deg)})[0]
    assert_allclose(damaged, MEAN * pair_stiffness(a_mesh().profile, x - s), rtol=1e-12, atol=1e-6)


@given(shift=st.floats(-0.5, 0.5), profile=st.sampled_from(PROFILES))
@settings(deadline=None, max_examples=60)
def test_a_shifted_profile_never_runs_backwards(shift, profile):
    """Rising to its plateau and falling from it, once each: the argument of the profile rises everywhere."""
    u = np.linspace(-1, 5, 3001)
    k = tooth_stiffness(a_mesh(*profile), TEETH, u, {1: ToothDamage(phase_shift_deg=shift * 360 / TEETH)})[0]
    slope = np.diff(k) / MEAN
    top = k > k.max() * (1 - 1e-9)
    first, last = np.flatnonzero(top)[[0, -1]]
    assert (slope[:first] >= -1e-12).all()
    assert (slope[last:] <= 1e-12).all()
    assert_allclose(k.max(), MEAN / (profile[0] - profile[1]), rtol=1e-5)


def test_loss_over_the_whole_contact_scales_the_whole_tooth():
    healthy, damaged = (
        tooth_stiffness(a_mesh(), TEETH, passes(), d) for d in ({}, {6: ToothDamage(stiffness_loss=0.4)})
    )
    assert_allclose(damaged[5], 0.6 * healthy[5], rtol=1e-12)


def test_loss_over_no_contact_changes_nothing():
    nothing = ToothDamage(stiffness_loss=1.0, loss_extent=0.0)
    healthy, damaged = (tooth_stiffness(a_mesh(), TEETH, passes(), d) for d in ({}, {6: nothing}))
    assert_array_equal(damaged, healthy)


def test_pitting_takes_the_first_part_of_the_contact_and_leaves_the_rest():
    """50 % over the first 20 %: full loss at 13 % of the contact, none at 22 %, falling between."""
    x = np.linspace(0.02, 1.28, 600)
    healthy = MEAN * pair_stiffness(a_mesh().profile, x)
    damage = {1: ToothDamage(stiffness_loss=0.5, loss_extent=0.2)}
    ratio = tooth_stiffness(a_mesh(), TEETH, x, damage)[0] / healthy
    assert_allclose(ratio[x <= 0.13 * 1.3], 0.5, rtol=1e-12)
    assert_allclose(ratio[x >= 0.22 * 1.3], 1.0, rtol=1e-12)
    assert (np.diff(ratio) >= -1e-12).all()


@given(loss=st.floats(0, 1), extent=st.floats(0, 1), more=st.floats(0, 1))
@settings(deadline=None, max_examples=40)
def test_more_extent_takes_more_and_stiffness_stays_between_nothing_and_healthy(loss, extent, more):
    u = passes(32)
    healthy = tooth_stiffness(a_mesh(), TEETH, u, {})[2]
    less = tooth_stiffness(a_mesh(), TEETH, u, {3: ToothDamage(stiffness_loss=loss, loss_extent=extent)})[2]
    most = max(extent, more)
    greater = tooth_stiffness(a_mesh(), TEETH, u, {3: ToothDamage(stiffness_loss=loss, loss_extent=most)})[2]
    tiny = 1e-9 * MEAN
    assert (greater >= -tiny).all()
    assert (greater <= less + tiny).all()
    assert (less <= healthy + tiny).all()


def test_wrapped_damage_reaches_the_teeth_on_both_sides_of_the_mark():
    damage = Damage(tooth=12, damaged_teeth=3, stiffness_loss=0.5).on_teeth(TEETH)
    healthy, damaged = (tooth_stiffness(a_mesh(), TEETH, passes(), d) for d in ({}, damage))
    share = damaged.sum(axis=1) / healthy.sum(axis=1)
    assert_allclose(share, np.where(np.isin(np.arange(1, 13), [12, 1, 2]), 0.5, 1.0), rtol=1e-12)


def test_a_shift_beyond_half_a_pass_is_refused():
    tooth_stiffness(a_mesh(), TEETH, passes(), {1: ToothDamage(phase_shift_deg=15.0)})
    with pytest.raises(
        InputError, match=r"phase_shift_deg = -15\.1 is more than half a tooth pass of a gear of 12 teeth"
    ):
        tooth_stiffness(a_mesh(), TEETH, passes(), {1: ToothDamage(phase_shift_deg=-15.1)})
