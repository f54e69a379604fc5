"""Verification: the march on one oscillator against closed forms, the laws of conservation, and DOP853."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

ONE = np.ones(2)
DEAD = 2.0
PHASE = 2 * np.pi * np.arange(4097) / 4096


def order(errors):
    """Order of convergence when steps are halved each time."""
    return np.log2(np.asarray(errors)[:-1] / np.asarray(errors)[1:])


def test_a_force_that_is_linear_in_time_is_followed_exactly(oscillator):
    """x'' + x = a t from rest at the place of no force: x = a (t - sin t), with ten steps to a period."""
    step, steps, slope = 0.6, 100, 0.3
    t = step * np.arange(steps + 1)
    x, v, force = oscillator(ONE, step)(0.0, 0.0, steps, forces=slope * t)
    assert_allclose(x, slope * (t - np.sin(t)), rtol=0, atol=1e-12)
    assert_allclose(v, slope * (1 - np.cos(t)), rtol=0, atol=1e-12)
    assert_allclose(force, x, rtol=0, atol=1e-12)


def test_an_open_mesh_without_force_flies_straight_whatever_the_step(oscillator):
    x, v, force = oscillator(ONE, 0.3)(-1.0, -0.5, 200)
    t = 0.3 * np.arange(201)
    assert_allclose(x, -1 - 0.5 * t, rtol=0, atol=1e-11)
    assert_allclose(v, -0.5, rtol=0, atol=1e-11)
    assert (force == 0).all()


def test_an_open_mesh_falls_along_a_parabola_to_second_order(oscillator):
    errors = []
    for steps in (50, 100, 200, 400):
        t = np.linspace(0, 8, steps + 1)
        x, _, force = oscillator(ONE, 8 / steps)(-1.0, -0.5, steps, forces=np.full(steps + 1, -0.2))
        assert (force == 0).all()
        errors.append(np.abs(x - (-1 - 0.5 * t - 0.1 * t**2)).max())
    assert_allclose(order(errors), 2, atol=0.02)
    assert errors[-1] < 3e-4


def test_chattering_between_the_flanks_conserves_energy_to_second_order(oscillator):
    """Undamped, for 60 natural periods and some 100 impacts."""
    errors = []
    for steps in (64, 128, 256, 512):
        x, v, force = oscillator(ONE, 2 * np.pi / steps, backlash=DEAD)(0.0, 1.0, 60 * steps)
        energy = v**2 / 2 + np.maximum(x, 0) ** 2 / 2 + np.minimum(x + DEAD, 0) ** 2 / 2
        assert force.max() > 0.9
        assert force.min() < -0.9
        errors.append(np.abs(energy / energy[0] - 1).max())
    assert_allclose(order(errors), 2, atol=0.1)
    assert errors[-1] < 1e-4


@pytest.mark.parametrize("error", [0.0, 0.1, -0.1])
def test_the_force_is_the_stiffness_times_what_is_beyond_a_flank(oscillator, error):
    """``k max(x - e, 0) + k min(x - e + b, 0)``: without a jump at either flank, wherever an error puts it."""
    x, _, force = oscillator(3 * ONE, 0.01, mean=3.0, backlash=0.4, error=error)(0.5, 2.0, 5000)
    expected = 3 * (np.maximum(x - error, 0) + np.minimum(x - error + 0.4, 0))
    assert_allclose(force, expected, rtol=0, atol=1e-13)
    assert (force == 0).sum() > 100
    assert force.min() < 0 < force.max()


def forced(t, r, depth, zeta, amplitude):
    """DOP853 of the oscillator with a varying mesh, a dead zone and a force, from the static place."""

    def slope(t, state):
        x, v = state
        k = 1 + depth * np.cos(r * t)
        mesh = k * (max(x, 0.0) + min(x + DEAD, 0.0))
        return [v, 0.1 + amplitude * np.cos(r * t) - 2 * zeta * v - mesh]

    found = solve_ivp(slope, (0, t[-1]), [0.1, 0.0], method="DOP853", t_eval=t, rtol=1e-10, atol=1e-12, max_step=0.02)
    assert found.success
    return found.y


@pytest.mark.parametrize(("r", "depth", "amplitude", "back"), [(0.9, 0.2, 0.05, False), (0.7, 0.3, 0.6, True)])
def test_an_oscillator_that_loses_contact_moves_as_by_dop853(oscillator, r, depth, amplitude, back):
    """Ten periods from rest; second order in the step although contact is lost and found within steps."""
    t = 2 * np.pi / r * np.arange(10 * 64 + 1) / 64
    expected = forced(t, r, depth, 0.05, amplitude)
    errors = []
    for finer in (4, 8, 16, 32):
        at = np.arange(10 * 64 * finer + 1) / (64 * finer)
        march = oscillator(1 + depth * np.cos(PHASE), 2 * np.pi / r / 64 / finer, zeta=0.05, force=0.1, backlash=DEAD)
        forces = amplitude * np.cos(2 * np.pi * at)
        x, v, force = march(0.0, 0.0, len(at) - 1, turns=at, forces=forces)
        assert (force == 0).any()
        assert bool((force < 0).any()) is back
        errors.append(np.abs(np.array([x, v])[:, ::finer] - expected).max())
    assert errors[-1] < 1e-4 * np.ptp(expected[0])
    assert_allclose(np.log2(errors[0] / errors[-1]) / 3, 2, atol=0.15)


@pytest.mark.parametrize("loses", [False, True])
def test_a_settled_period_takes_up_what_it_dissipates(oscillator, loses):
    """Work of the stiffness variation, of the alternating and of the constant force, against 2 zeta times the integral
    of the squared velocity. Where contact is lost the force has kinks, and the sums are of second order."""
    r, zeta, mean, amplitude = 0.9, 0.05, 0.1, 0.06 if loses else 0.005
    defects = []
    for steps in (512, 1024, 2048):
        at = np.arange(120 * steps + 1) / steps
        alternating = amplitude * np.cos(2 * np.pi * at)
        march = oscillator(1 + 0.2 * np.cos(PHASE), 2 * np.pi / r / steps, zeta=zeta, force=mean, backlash=DEAD)
        x, v, force = march(0.0, 0.0, 120 * steps, turns=at, forces=alternating)
        last = slice(-steps, None)
        assert bool((force[last] == 0).any()) is loses
        assert_allclose(x[last], x[-2 * steps : -steps], rtol=0, atol=1e-4 * np.ptp(x[last]))
        h = 2 * np.pi / r / steps
        work = h * ((mean + alternating - force) * v)[last].sum()
        dissipated = h * 2 * zeta * (v[last] ** 2).sum()
        # Each of the parts counts.
        assert abs(h * (force * v)[last].sum()) > 0.05 * dissipated
        defects.append(abs(work / dissipated - 1))
    assert defects[-1] < 1e-4
    assert np.log2(defects[0] / defects[-1]) / 2 > 1.7
