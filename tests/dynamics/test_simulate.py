"""Unit: one call from rig, damage and specimen to a response, and what it warns of and refuses."""

import warnings
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError, UnstableRigError
from sigdb.dynamics import ContactLossWarning, Periodic, march, prepare, prepare_periodic, simulate
from sigdb.transmission import Damage, load_transmission


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def healthy(rig):
    return simulate(rig)


def test_the_healthy_response_is_named_by_sensor_with_units(healthy):
    assert healthy.gear == "pinion"
    assert not healthy.damage.is_damage
    assert healthy.units == {"pinion-vertical": "m/s", "pinion-housing-vertical": "m/s^2"}
    assert healthy.signal("pinion-vertical").shape == (768,)
    assert healthy.compression.shape == (768,)
    with pytest.raises(InputError, match=r"no sensor 'pinion'; known: pinion-vertical, pinion-housing-vertical"):
        healthy.signal("pinion")


def test_several_damages_give_a_response_each(rig, healthy):
    damages = [None, {"tooth": 4, "stiffness_loss": 0.3}, Damage(tooth=2, phase_shift_deg=1.0)]
    responses = simulate(rig, damages)
    assert_allclose(responses[0].signal("pinion-vertical"), healthy.signal("pinion-vertical"), rtol=0, atol=0)
    for damage, response in zip(damages, responses, strict=True):
        alone = prepare(rig).simulate(damage)
        assert_allclose(response.compression, alone.compression, rtol=0, atol=0)
        assert response.floquet_multiplier == alone.floquet_multiplier
    assert simulate(rig, []) == []
    assert len(prepare(rig).simulate(damages)) == 3


def test_equal_rigs_are_prepared_once_and_others_anew(rig):
    prepared = []

    @dataclass(frozen=True)
    class Counting(Periodic):
        def prepare(self, rig, gear=None, *, system=None):
            prepared.append((rig.operating.torque, gear))
            return super().prepare(rig, gear, system=system)

    other = rig.replace({"operating.torque": 2 * rig.operating.torque})
    for each in (rig, load_transmission("nasa-spiral-bevel"), other, rig):
        for tooth in (1, 2):
            simulate(each, {"tooth": tooth, "stiffness_loss": 0.2}, solver=Counting())
    simulate(rig, {"gear": "gear", "tooth": 1, "stiffness_loss": 0.2}, solver=Counting())
    torque = rig.operating.torque
    assert prepared == [(torque, None), (2 * torque, None), (torque, "gear")]


def test_it_is_affine_in_the_index_errors(rig, healthy):
    """f(a + 2 b) - f(0) = (f(a) - f(0)) + 2 (f(b) - f(0)), with damage."""
    damage = Damage(tooth=4, stiffness_loss=0.3)
    rng = np.random.default_rng(4)
    a, b = 2e-6 * rng.standard_normal((2, 12))
    at = [simulate(rig, damage, index_errors=e) for e in (None, a, b, a + 2 * b)]
    for sensor in healthy.signals:
        zero, first, second, both = (response.signal(sensor) for response in at)
        assert_allclose(both - zero, (first - zero) + 2 * (second - zero), rtol=0, atol=1e-9 * np.ptp(zero))
    zero, first, second, both = (response.compression for response in at)
    assert_allclose(both - zero, (first - zero) + 2 * (second - zero), rtol=0, atol=1e-9 * np.ptp(zero))


def test_a_rig_may_be_named_and_damage_given_by_its_fields(rig, tmp_path):
    fields = {"tooth": 6, "stiffness_loss": 0.5}
    expected = simulate(rig, Damage(**fields)).signal("pinion-vertical")
    for named, damage in (("nasa-spiral-bevel", fields), (rig, fields), ("nasa-spiral-bevel", Damage(**fields))):
        assert_allclose(simulate(named, damage).signal("pinion-vertical"), expected, rtol=0, atol=0)
    with pytest.raises(InputError, match=r"missing\.toml: no such file"):
        simulate(tmp_path / "missing.toml")
    with pytest.raises(InputError, match=r"damage: unknown key stiffnes_loss; did you mean 'stiffness_loss'"):
        march("nasa-spiral-bevel", {"tooth": 6, "stiffnes_loss": 0.5}, duration=0.01, sampling_rate=1e4)


@pytest.mark.parametrize(
    "call", [simulate, partial(march, duration=0.01, sampling_rate=1e4)], ids=["simulate", "march"]
)
def test_other_types_are_refused_with_what_to_give(rig, call):
    with pytest.raises(
        TypeError, match=r"rig is of type dict; give a Transmission, as of sigdb\.load_transmission, or"
    ):
        call({"name": "mine"})
    with pytest.raises(TypeError, match=r"damage is of type float; give sigdb\.Damage\(tooth=3, stiffness_loss=0\.3\)"):
        call(rig, 0.5)


def test_no_index_errors_are_zero_index_errors(rig, healthy):
    zero = simulate(rig, index_errors=[0.0] * 12)
    for sensor, signal in healthy.signals.items():
        assert_allclose(zero.signal(sensor), signal, rtol=0, atol=0)


def test_the_solver_says_how_many_samples_a_tooth(rig):
    response = simulate(rig, Damage(gear="gear", tooth=36, stiffness_loss=0.3), solver=Periodic(samples_per_tooth=16))
    assert response.gear == "gear"
    assert response.signal("pinion-vertical").shape == (16 * 36,)


def test_a_damaged_tooth_disturbs_its_own_pass_first(rig, healthy):
    """Causality within the revolution: the compression departs from the healthy one most in pass 6 or the next."""
    damaged = simulate(rig, Damage(tooth=6, stiffness_loss=0.5))
    change = np.abs(damaged.compression - healthy.compression).reshape(12, 64).max(axis=1)
    assert change.argmax() in (5, 6)
    assert change[4] < 0.35 * change.max()


def test_least_compression_is_a_share_of_the_static_one(rig, healthy):
    radius = 0.0049407 * 6 - 0.0127 * np.sin(np.arctan(1 / 3))
    static = 356.05 / (radius * np.cos(np.deg2rad(22.5)) * np.cos(np.deg2rad(35))) / 2.2e8
    assert_allclose(healthy.min_compression, healthy.compression.min() / static, rtol=1e-6)
    assert not healthy.contact_loss


def test_loss_of_contact_is_warned_of_and_marked(rig):
    """A tooth that touches 0.2 mm late: some 2.4 times the static compression."""
    errors = np.zeros(12)
    errors[5] = 2e-4
    with pytest.warns(ContactLossWarning, match=r"loses contact \(least mesh force -\d+\.\d\d of the static one\)"):
        response = simulate(rig, index_errors=errors)
    assert response.contact_loss
    assert response.min_compression < 0


def test_contact_that_is_kept_is_not_warned_of(rig):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate(rig, Damage(tooth=6, stiffness_loss=0.5))


@pytest.mark.parametrize("errors", [np.zeros(11), np.zeros((12, 1)), 0.0, [float("nan")] * 12])
def test_index_errors_must_be_one_finite_number_a_tooth(rig, errors):
    with pytest.raises(InputError, match=r"index_errors must be 12 finite numbers, one a tooth of the damaged gear"):
        simulate(rig, index_errors=errors)


def test_damage_must_fit_the_rig(rig):
    with pytest.raises(InputError, match=r"tooth 13 does not exist: the gear has 12 teeth"):
        simulate(rig, Damage(tooth=13, stiffness_loss=0.5))
    with pytest.raises(InputError, match=r"gear = 'wheel' does not exist"):
        simulate(rig, Damage(gear="wheel", tooth=1, stiffness_loss=0.5))
    with pytest.raises(InputError, match=r"more than half a tooth pass"):
        simulate(rig, Damage(tooth=1, phase_shift_deg=16.0))


def test_the_filed_rig_is_stable_with_a_broken_tooth(rig, healthy):
    assert healthy.floquet_multiplier < 1
    assert simulate(rig, Damage(tooth=6, stiffness_loss=0.5)).floquet_multiplier < 1


@pytest.fixture(scope="module")
def resonant(rig):
    """Hardly damped, with a stiffness that jumps between one pair and two, near a parametric resonance."""
    undamped_casing = {f"casing.modes.{i}.damping_ratio": 5e-4 for i in range(3)}
    profile = {"main.profile.contact_ratio": 1.5, "main.profile.flank": 0.1}
    return rig.replace({"damping_ratio": 5e-4, "operating.speed_rpm": 21000.0} | profile | undamped_casing)


def test_an_unstable_rig_is_refused_with_its_speed_and_a_remedy(resonant):
    message = r"'nasa-spiral-bevel' is unstable at 21000 rpm \(Floquet multiplier .*\).*raise the damping or"
    with pytest.raises(UnstableRigError, match=message):
        simulate(resonant)
    remedied = resonant.replace({"damping_ratio": 0.1})
    assert simulate(remedied, solver=Periodic(samples_per_tooth=32)).floquet_multiplier < 1
    elsewhere = resonant.replace({"operating.speed_rpm": 9000.0})
    assert simulate(elsewhere, solver=Periodic(samples_per_tooth=32)).floquet_multiplier < 1


def test_stable_multiplier_is_the_one_that_is_reported(rig, healthy):
    prepared = prepare_periodic(rig)
    found = prepared.floquet_multiplier([{}])
    assert_allclose(found, healthy.floquet_multiplier, rtol=1e-12)
