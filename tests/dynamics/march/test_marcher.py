"""Unit and verification: an element that is not linear is marched, and the periodic solver refuses it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from sigdb.core import NotApplicableError, SigdbError
from sigdb.dynamics import Periodic, PeriodicOrTransient, Transient, march, prepare_periodic
from sigdb.transmission import NonlinearElement, load_transmission, modal_system

CUBIC = 2.0


def spring(law, column=0):
    return NonlinearElement(name="spring", columns=(column,), rows=(0,), law=law)


def hardening(motion):
    return -CUBIC * motion**3


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel").replace({"damping_ratio": 0.2})


@pytest.fixture(scope="module")
def stiffened(rig):
    """The rig's modal system with a hardening spring along its mesh, of a fifth of the static force."""
    system = modal_system(rig)
    static = system.transfer(np.zeros(1))[0, 0, 1].real
    force = system.mesh_stiffness[0] * static / 5
    return replace(system, elements=(*system.elements, spring(lambda motion: -force * (motion / static) ** 3)))


def test_a_hardening_spring_moves_the_oscillator_as_by_dop853(oscillator):
    """``x'' + 2 zeta x' + x + c x^3 = 0.3 + 0.1 cos(0.8 t)`` from rest at the linear static place; second order."""
    r, zeta, periods = 0.8, 0.05, 4
    t = 2 * np.pi / r * np.arange(periods * 16 + 1) / 16

    def slope(t, state):
        x, v = state
        return [v, 0.3 + 0.1 * np.cos(r * t) - 2 * zeta * v - x - CUBIC * x**3]

    exact = solve_ivp(slope, (0, t[-1]), [0.3, 0.0], method="DOP853", t_eval=t, rtol=1e-11, atol=1e-13).y
    assert exact[0].min() > 0
    errors = []
    for finer in (4, 8, 16):
        at = np.arange(periods * 16 * finer + 1) / (16 * finer)
        step = 2 * np.pi / r / (16 * finer)
        motion = oscillator(np.ones(2), step, zeta=zeta, force=0.3, elements=[spring(hardening)])
        x, v, force = motion(0.0, 0.0, len(at) - 1, forces=0.1 * np.cos(2 * np.pi * at))
        assert_allclose(force, x, rtol=1e-12)  # the mesh's own force does not hold the spring's
        errors.append(np.abs(np.array([x, v])[:, ::finer] - exact).max())
    assert errors[-1] < 2e-3 * np.ptp(exact[0])
    assert_allclose(np.log2(errors[0] / errors[-1]) / 2, 2, atol=0.15)


def test_a_law_of_no_force_changes_no_bit(oscillator):
    forces = np.cos(np.arange(201) / 10)
    plain, with_law = (
        oscillator(np.ones(2), 0.1, zeta=0.05, elements=elements)(0.5, 0.0, 200, forces=forces)
        for elements in ([], [spring(np.zeros_like)])
    )
    for one, other in zip(plain, with_law, strict=True):
        assert_allclose(one, other, rtol=0, atol=1e-14)


def test_a_law_too_stiff_for_the_step_is_an_error_and_no_number(oscillator):
    motion = oscillator(np.ones(2), 1.0, elements=[spring(lambda x: -1e6 * x)])
    with pytest.raises(SigdbError, match="do not converge within a step; give more steps_per_tooth"):
        motion(0.5, 0.0, 10)


@pytest.mark.parametrize("solver", [Periodic(samples_per_tooth=16), PeriodicOrTransient()])
def test_the_periodic_solution_of_a_nonlinear_rig_is_refused(rig, stiffened, solver):
    with pytest.raises(NotApplicableError, match=r"elements that are not linear.*\(spring\).*sigdb\.Transient"):
        solver.prepare(rig, system=stiffened)
    assert prepare_periodic(rig, samples_per_tooth=16).gear == "pinion"


def test_the_march_of_a_nonlinear_rig_settles_where_its_forces_balance_the_torque(rig, stiffened):
    solver = Transient(samples_per_tooth=16, steps_per_tooth=64, tolerance=1e-3)
    prepared = solver.prepare(rig, system=stiffened)
    assert prepared.linear is None
    assert np.isnan(prepared.floquet_multiplier([{}]))
    state = prepared.steady_state([{}])[0]
    static = state.static_compression
    spring_force = stiffened.mesh_stiffness[0] * static / 5 * ((state.compression / static) ** 3).mean()
    # The spring takes its part of the static force from the teeth.
    assert_allclose(state.mesh_force.mean() + spring_force, stiffened.mesh_stiffness[0] * static, rtol=1e-3)
    assert 0.05 < spring_force / (stiffened.mesh_stiffness[0] * static) < 0.2


def test_raw_signals_have_the_sensors_only(rig, stiffened):
    history = march(rig, duration=2e-4, sampling_rate=50e3, system=stiffened, steps_per_tooth=16)
    assert set(history.signals) == set(rig.sensors)
    assert set(history.compression) == {"main"}
