"""Disturbances: exact changes of averages and noise, with the sizes that their names say."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.core.errors import InputError
from sigdb.pipeline.robustness import disturbances
from sigdb.transmission import ToothDamage

TEETH, N = 6, 192
STREAM = np.random.default_rng(4)
X = np.fft.irfft(np.r_[0, STREAM.standard_normal(80) + 1j * STREAM.standard_normal(80), np.zeros(16)], N)
ROWS = np.tile(X, (400, 1))


@pytest.mark.parametrize("orders", [2.0, 0.0])
def test_a_path_has_its_gain_phase_and_smoothness(orders):
    changed = disturbances.path(ROWS, TEETH, np.random.default_rng(1), db=2.0, deg=10.0, orders=orders)
    ratio = np.fft.rfft(changed, axis=1)[:, 1:80] / np.fft.rfft(ROWS, axis=1)[:, 1:80]
    gain, phase = 20 * np.log10(np.abs(ratio)), np.degrees(np.angle(ratio))
    assert abs(gain.std() - 2.0) < 0.1
    assert abs(phase.std() - 10.0) < 0.5
    width = int(orders or TEETH)
    alike = np.mean(gain[:, :-width] * gain[:, width:]) / gain.var()
    assert abs(alike - np.exp(-0.5)) < 0.06


def test_a_mark_that_is_late_by_a_pass_turns_by_a_tooth():
    changed = disturbances.late_mark(ROWS[:1], TEETH, STREAM, passes=1.0)
    assert_allclose(changed[0], np.roll(X, N // TEETH), atol=1e-12)


def test_modulation_adds_sidebands_of_half_its_depth():
    wave = np.cos(2 * np.pi * 12 * np.arange(N) / N)[None]
    spectrum = np.abs(np.fft.rfft(disturbances.modulation(wave, TEETH, STREAM, depth=0.2)[0])) * 2 / N
    assert_allclose(spectrum[[11, 12, 13]], [0.1, 1.0, 0.1], atol=1e-12)


def test_a_ghost_order_is_no_mesh_order_and_has_its_share():
    added = np.fft.rfft(disturbances.ghost(ROWS, TEETH, np.random.default_rng(2), share=0.3) - ROWS, axis=1)
    order = np.abs(added).argmax(axis=1)
    assert (order % TEETH > 0).all()
    assert len(set(order)) > 3
    assert_allclose(np.sqrt(2) * np.abs(added).max(axis=1) / N, 0.3 * X.std(), rtol=1e-9)


def test_lost_pulses_leave_what_repeats_twice_as_often():
    """The mean of a revolution keeps its share; two revolutions in one show each order at its double."""
    wave = np.cos(2 * np.pi * 5 * np.arange(N) / N)[None]
    spectrum = np.fft.rfft(disturbances.lost_pulses(wave, TEETH, STREAM, share=0.05)[0]).real * 2 / N
    assert_allclose(spectrum[[5, 10]], [1 - 0.05 / 0.95, 0.05 / 0.95], atol=1e-12)


@pytest.mark.parametrize("law", [disturbances.gaussian, disturbances.bursts])
def test_noise_of_another_law_has_the_same_variance(law):
    assert abs(law(np.random.default_rng(5), 300, N, 8).var() - 1) < 0.03


def test_low_orders_have_the_variance_of_white_noise_and_half_the_power_at_the_mesh_order():
    shape = disturbances.low_orders(N, TEETH)
    assert_allclose((shape[TEETH] / shape[0]) ** 2, 0.5)
    assert_allclose((np.r_[shape, shape[-2:0:-1]] ** 2).mean(), 1.0)


def test_another_rig_stays_inside_what_is_assumed_and_within_its_share():
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    values = rig.assumptions.values_of(rig)
    other = disturbances.another_rig(rig, "pinion", np.random.default_rng(7), share=0.2)
    changed = other.assumptions.values_of(other)
    numbers = [name for name, value in values.items() if isinstance(value, float)]
    ratio = np.array([changed[name] / values[name] for name in numbers])
    assert (np.abs(ratio - 1) <= 0.2 + 1e-9).all()
    assert (ratio != 1).mean() > 0.8


def test_only_a_machine_with_a_soft_form_has_one():
    rig = sigdb.load_transmission("nasa-spiral-bevel").replace({"operating.speed_rpm": 14000.0})
    soft = disturbances.soft_form(rig, "pinion", STREAM)
    assert (soft.name, soft.operating.speed_rpm) == ("nasa-spiral-bevel-soft", 14000.0)
    with pytest.raises(InputError, match="no built-in rig 'spur-test-rig-soft'"):
        disturbances.soft_form(sigdb.load_transmission("spur-test-rig"), "pinion", STREAM)


def test_damage_changes_as_the_names_say():
    damage = {2: ToothDamage(stiffness_loss=0.2)}
    assert {tooth: each.stiffness_loss for tooth, each in disturbances.apart(damage, 6).items()} == {2: 0.2, 5: 0.2}
    assert disturbances.apart({}, 6) == {}
    assert disturbances.beyond_grid(damage, 6)[2].stiffness_loss == 0.7
    worn = disturbances.worn(damage, 6)
    assert sorted(worn) == [1, 2, 3, 4, 5, 6]
    assert worn[2].stiffness_loss == 0.2
    assert all(3e-6 <= each.flank_deviation <= 5e-6 for each in worn.values())


def test_names_are_different():
    names = [each.name for each in disturbances.DISTURBANCES]
    assert len(set(names)) == len(names) == 30
