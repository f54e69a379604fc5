"""Verification: Floquet multipliers against closed forms, and their invariances."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics import floquet_multiplier, prepare_periodic
from sigdb.dynamics.stability import first_order_hold
from sigdb.transmission import ModalSystem, load_transmission, modal_system


def oscillator(zeta, omega=1.0, mass=1.0):
    """m x'' + 2 zeta omega m x' + k x = f with mean k = m omega^2, as the modal system of one mesh."""
    damped = omega * np.sqrt(1 - zeta**2 + 0j)
    poles = np.array([-zeta * omega + 1j * damped, -zeta * omega - 1j * damped])
    inputs = np.array([[1.0], [-1.0]]) / (2j * damped * mass)
    return ModalSystem(
        poles=poles,
        inputs=np.hstack([inputs, inputs]),
        outputs=np.ones((1, 2), dtype=complex),
        direct=np.zeros((1, 2)),
        meshes=("main",),
        sensors=(),
        mesh_stiffness=np.array([mass * omega**2]),
    )


@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.3])
def test_constant_mean_stiffness_gives_the_decay_of_the_slowest_pole(zeta):
    period, omega = 2.3, 3.0
    multiplier = floquet_multiplier(oscillator(zeta, omega, mass=0.7), np.full(50, 0.7 * 9.0), period)
    assert_allclose(multiplier, np.exp(-zeta * omega * period), rtol=1e-12)


@pytest.mark.parametrize("ratio", [0.6, 1.3])
def test_another_constant_stiffness_moves_the_frequency_and_not_the_decay(ratio):
    """x'' + 2 zeta x' + r x = 0 decays as exp(-zeta t) for any r > zeta^2, to the second order of the steps."""
    errors = [
        abs(floquet_multiplier(oscillator(0.05), np.full(n, ratio), 4.0) - np.exp(-0.05 * 4.0)) for n in (40, 80, 160)
    ]
    assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2, atol=0.2)
    assert errors[-1] < 1e-4


def test_stiffness_below_zero_makes_an_undamped_oscillator_run_away():
    """x'' = x has the multiplier exp(T)."""
    assert_allclose(floquet_multiplier(oscillator(0.0), np.full(4000, -1.0), 2.0), np.exp(2.0), rtol=1e-5)


def test_constant_mean_stiffness_on_the_nasa_rig_leaves_the_slowest_pole():
    system = modal_system(load_transmission("nasa-spiral-bevel"))
    multiplier = floquet_multiplier(system, np.full(768, 2.2e8), 1 / 240)
    assert_allclose(multiplier, np.exp(system.poles.real.max() / 240), rtol=1e-9)


def resonant_rig():
    changes = {f"casing.modes.{i}.damping_ratio": 5e-4 for i in range(3)}
    changes |= {"damping_ratio": 5e-4, "operating.speed_rpm": 21000.0}
    return load_transmission("nasa-spiral-bevel").replace(
        changes | {"main.profile.contact_ratio": 1.5, "main.profile.flank": 0.1}
    )


def test_the_multiplier_converges_with_the_steps_and_over_whole_tooth_passes():
    """One revolution has 12 equal tooth passes: its multiplier is that of one pass to the twelfth power."""
    prepared = prepare_periodic(resonant_rig(), samples_per_tooth=64)
    k, period = prepared.healthy[0], 2 * np.pi / prepared.shaft_speed
    revolution = floquet_multiplier(prepared.system, k, period)
    assert revolution > 1.5
    assert_allclose(floquet_multiplier(prepared.system, k[:64], period / 12) ** 12, revolution, rtol=1e-6)
    twice = prepare_periodic(resonant_rig(), samples_per_tooth=128)
    assert_allclose(floquet_multiplier(twice.system, twice.healthy[0], period), revolution, rtol=0.05)


def test_a_truncated_system_with_residual_flexibility_has_nearly_the_same_multiplier():
    """The direct term takes part in the closed loop of the mesh."""
    prepared = prepare_periodic(resonant_rig(), samples_per_tooth=64)
    k, period = prepared.healthy[0, :64], 2 * np.pi / prepared.shaft_speed / 12
    full, truncated = (floquet_multiplier(s, k, period) for s in (prepared.system, prepared.system.truncated(48)))
    assert prepared.system.truncated(48).direct[0, 0] > 0
    assert_allclose(truncated, full, rtol=1e-3)


def test_scaling_of_the_modes_leaves_the_multiplier():
    """Scaling a mode's input up and its output down is the same system."""
    system = oscillator(0.03)
    scale = np.array([2 + 1j, 2 - 1j])
    scaled = replace(system, inputs=system.inputs * scale[:, None], outputs=system.outputs / scale)
    k = 1 + 0.3 * np.sin(2 * np.pi * np.arange(200) / 200)
    assert_allclose(floquet_multiplier(scaled, k, 3.0), floquet_multiplier(system, k, 3.0), rtol=1e-12)


def test_residual_flexibility_is_a_spring_in_series_with_the_change_of_stiffness():
    """With delta = x + R f and f = -kappa delta, f = -kappa / (1 + R kappa) x: exact for any course of kappa."""
    system, residual = oscillator(0.02), 0.7
    series = replace(system, direct=np.full((1, 2), residual))
    kappa = 0.6 * np.sin(2 * np.pi * np.arange(300) / 300) + 0.2
    with_residual = floquet_multiplier(series, 1 + kappa, 3.1)
    assert_allclose(with_residual, floquet_multiplier(system, 1 + kappa / (1 + residual * kappa), 3.1), rtol=1e-12)
    assert abs(with_residual / floquet_multiplier(system, 1 + kappa, 3.1) - 1) > 1e-2


def test_real_poles_of_an_overdamped_oscillator_decay_as_they_should():
    """x'' + 10 x' + k x = 0 with a mean k of 9 (poles -1, -9) and an actual k of 16 (poles -2, -8), by hand."""
    system = ModalSystem(
        poles=np.array([-1.0, -9.0], complex),
        inputs=np.array([[1 / 8, 0], [-1 / 8, 0]], complex),
        outputs=np.ones((1, 2), complex),
        direct=np.zeros((1, 2)),
        meshes=("main",),
        sensors=(),
        mesh_stiffness=np.array([9.0]),
    )
    assert_allclose(floquet_multiplier(system, np.full(2000, 16.0), 1.0), np.exp(-2.0), rtol=1e-5)


def stepped(system, stiffness, period):
    """The multiplier by marching each unit state step by step, with the compression of each step solved in turn."""
    n, meshes = stiffness.shape[1], len(system.meshes)
    E, g0, g1 = first_order_hold(system.poles, period / n)
    b, c, direct = system.inputs[:, :meshes], system.outputs[:meshes], system.direct[:meshes, :meshes]
    kappa = (stiffness - system.mesh_stiffness[:, None]).T
    z = np.eye(len(E), dtype=complex)
    force = -np.linalg.solve(np.eye(meshes) + kappa[-1][:, None] * direct, kappa[-1][:, None] * (c @ z))
    for k in kappa:
        free = E[:, None] * z + (b * g0[:, None]) @ force
        compliance = c @ (b * g1[:, None]) + direct
        force = -np.linalg.solve(np.eye(meshes) + k[:, None] * compliance, k[:, None] * (c @ free))
        z = free + (b * g1[:, None]) @ force
    return np.abs(np.linalg.eigvals(z)).max()


@pytest.mark.parametrize("steps", [7, 64, 96])
def test_parts_that_are_alike_are_marched_once_and_give_what_all_steps_do(steps):
    """Two meshes and six passes: one pass is weak, and the one after it begins otherwise."""
    system = modal_system(load_transmission("two-stage-gearbox")).truncated(48)
    stream = np.random.default_rng(2)
    once = system.mesh_stiffness[:, None] * (1 + 0.2 * stream.normal(size=(len(system.meshes), steps)))
    stiffness = np.tile(once, 6)
    stiffness[0, steps : 2 * steps] *= 0.6
    multiplier = floquet_multiplier(system, stiffness, 0.004, passes=6)
    assert_allclose(multiplier, stepped(system, stiffness, 0.004), rtol=1e-8)
    assert_allclose(multiplier, floquet_multiplier(system, stiffness, 0.004), rtol=1e-8)
