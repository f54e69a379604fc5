"""Unit: what a march in time refuses, with a message that says what to give; and profiles over time."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError, SigdbError
from sigdb.dynamics import TimeProfile, Transient, march, prepare_periodic, settle, simulate
from sigdb.transmission import Damage, load_transmission

SHORT = {"duration": 0.001, "sampling_rate": 20e3}


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"duration": 0.0}, r"duration = 0\.0 must be above zero"),
        ({"duration": np.nan}, r"duration = nan must be above zero"),
        ({"duration": np.inf}, r"duration = inf must be above zero"),
        ({"sampling_rate": -1.0}, r"sampling_rate = -1\.0 must be above zero"),
        ({"speed_rpm": 0.0}, r"speed_rpm falls to 0\.0; a march needs speeds above zero"),
        ({"speed_rpm": TimeProfile([0, 1], [100, -5])}, r"speed_rpm falls to -5; a march needs speeds above zero"),
        ({"speed_rpm": np.nan}, r"a time profile needs finite values at finite, rising times"),
        ({"torque": np.inf}, r"a time profile needs finite values at finite, rising times"),
        ({"tacho": "shaft"}, r"tacho = 'shaft' is no turning shaft of rig 'nasa.*'; name one of pinion-shaft, gear-sh"),
        ({"pulses_per_revolution": 0}, r"pulses_per_revolution = 0 must be a whole number of at least 1"),
        ({"pulses_per_revolution": 1.5}, r"pulses_per_revolution = 1\.5 must be a whole number of at least 1"),
        ({"steps_per_tooth": 0}, r"steps_per_tooth = 0 must be a whole number of at least 1"),
        ({"steps_per_tooth": 2.5}, r"steps_per_tooth = 2\.5 must be a whole number of at least 1"),
        ({"index_errors": [0.0] * 5}, r"index_errors must be 12 finite numbers, one a tooth .* shape \(5,\)"),
        ({"index_errors": [np.nan] * 12}, r"index_errors must be 12 finite numbers"),
        ({"state": np.zeros(3)}, r"state has the shape \(3,\); this rig's modal system has \d+ coordinates: give the"),
        ({"damage": Damage(gear="wheel", tooth=1, stiffness_loss=0.1)}, r"gear = 'wheel' does not exist"),
        ({"damage": Damage(tooth=13, stiffness_loss=0.1)}, r"tooth 13 does not exist: the gear has 12 teeth"),
        ({"damage": Damage(tooth=1, phase_shift_deg=16.0)}, r"more than half a tooth pass"),
    ],
)
def test_a_march_says_what_does_not_fit(rig, settings, says):
    with pytest.raises(InputError, match=says):
        march(rig, **(SHORT | settings))


@pytest.mark.parametrize("values", [{"operating.torque": 0.0}, {"operating.speed_rpm": 0.0}])
def test_a_march_needs_torque_and_speed(rig, values):
    with pytest.raises(InputError, match=r"has no torque through its meshes; give operating\.drive, load, speed and"):
        march(rig.replace(values), **SHORT)


def test_a_rig_without_drive_is_not_marched():
    with pytest.raises(InputError, match=r"'friswell-turbogenerator' has no torque through its meshes"):
        march(load_transmission("friswell-turbogenerator"), **SHORT)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"steps_per_tooth": 250}, r"steps_per_tooth = 250 must be a multiple of four times samples_per_tooth = 64"),
        ({"steps_per_tooth": 128}, r"steps_per_tooth = 128 must be a multiple of four times samples_per_tooth = 64"),
        ({"samples_per_tooth": 0}, r"samples_per_tooth = 0 must be a whole number of at least 1"),
        ({"steps_per_tooth": 0}, r"steps_per_tooth = 0 must be a whole number of at least 1"),
        ({"steps_per_tooth": 256.0}, r"steps_per_tooth = 256\.0 must be a whole number of at least 1"),
        ({"most_revolutions": 0}, r"most_revolutions = 0 must be a whole number of at least 1"),
        ({"tolerance": 0.0}, r"tolerance = 0\.0 must lie between 0 and 1; 1e-4 is usual"),
        ({"tolerance": np.nan}, r"tolerance = nan must lie between 0 and 1"),
    ],
)
def test_the_solver_says_what_does_not_fit(settings, says):
    with pytest.raises(InputError, match=says):
        Transient(**settings)


def test_a_motion_that_does_not_repeat_in_time_is_refused(rig):
    """From an equilibrium without the load's variation, two revolutions are not enough for 1e-9."""
    prepared = prepare_periodic(rig)
    state = np.zeros((prepared.system.poles.imag >= 0).sum(), complex)
    message = r"rig 'nasa.*': the motion does not repeat to 1e-09 of its size within 2 revolutions .* change the damage"
    with pytest.raises(SigdbError, match=message):
        settle(
            rig,
            gear="pinion",
            damage={},
            index_errors=np.zeros(12),
            state=state,
            solver=Transient(most_revolutions=2, tolerance=1e-9),
            system=prepared.system,
        )


def test_index_errors_of_a_march_are_checked_by_simulate_too(rig):
    with pytest.raises(InputError, match=r"index_errors must be 12 finite numbers"):
        simulate(rig, index_errors=[0.0], solver=Transient())


@pytest.mark.parametrize(
    ("time", "value", "says"),
    [
        ([], [], r"as many values as times, at least one"),
        ([0.0, 1.0], [1.0], r"as many values as times, at least one"),
        ([[0.0]], [[1.0]], r"as many values as times, at least one"),
        ([0.0, 0.0], [1.0, 2.0], r"finite values at finite, rising times"),
        ([1.0, 0.0], [1.0, 2.0], r"finite values at finite, rising times"),
        ([0.0, np.inf], [1.0, 2.0], r"finite values at finite, rising times"),
        ([0.0, 1.0], [1.0, np.nan], r"finite values at finite, rising times"),
    ],
)
def test_a_profile_says_what_does_not_fit(time, value, says):
    with pytest.raises(InputError, match=says):
        TimeProfile(time, value)


PROFILE = TimeProfile([-1.0, 0.5, 2.0, 2.5], [2.0, 5.0, 1.0, 1.0])


def test_a_profile_is_lines_and_constant_outside():
    assert_allclose(PROFILE(np.array([-3.0, -1.0, 0.0, 0.5, 1.25, 2.2, 9.0])), [2, 2, 4, 5, 3, 1, 1])
    assert_allclose(PROFILE.slope(np.array([-3.0, 0.0, 0.5, 1.25, 2.2, 9.0])), [0, 2, -8 / 3, -8 / 3, 0, 0])


def test_its_integral_is_that_of_a_fine_sum():
    t = np.linspace(0, 4, 40001)
    middle = PROFILE((t[1:] + t[:-1]) / 2)
    expected = np.concatenate([[0], np.cumsum(middle) * (t[1] - t[0])])
    assert_allclose(PROFILE.integral(t), expected, rtol=0, atol=1e-7)
    assert_allclose(PROFILE.integral(np.array([-1.0])), -(2 + 4) / 2, rtol=1e-12)


def test_reached_is_the_inverse_of_the_integral():
    t = np.array([0.0, 0.1, 0.5, 0.7, 1.9, 2.0, 2.3, 2.5, 7.0])
    assert_allclose(PROFILE.reached(PROFILE.integral(t)), t, rtol=1e-12, atol=1e-15)
    late = TimeProfile([3.0, 4.0], [1.0, 2.0])
    assert_allclose(late.reached(late.integral(t)), t, rtol=1e-12, atol=1e-15)
    assert_allclose(TimeProfile([5.0], [4.0]).reached(np.array([0.0, 2.0])), [0.0, 0.5])
