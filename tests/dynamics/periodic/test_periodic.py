"""Verification: the periodic solution of the NASA rig against a direct one in all harmonics, and its identities."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import toeplitz

from sigdb.core.errors import InputError
from sigdb.dynamics import prepare_periodic
from sigdb.dynamics.periodic import periodic
from sigdb.transmission import Damage, ToothDamage, load_transmission, modal_system
from sigdb.transmission.mesh.stiffness import tooth_stiffness

DAMAGES = {
    "healthy": {},
    "loss": {6: ToothDamage(stiffness_loss=0.5)},
    "shift": {2: ToothDamage(phase_shift_deg=3.0)},
    "pitted-broken-pitted": {
        12: ToothDamage(stiffness_loss=0.5, loss_extent=0.2),
        1: ToothDamage(stiffness_loss=0.5, phase_shift_deg=1.0),
        2: ToothDamage(stiffness_loss=0.5, loss_extent=0.2),
    },
    "all-worn": dict.fromkeys(range(1, 13), ToothDamage(phase_shift_deg=2.0, stiffness_loss=0.1)),
}


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def prepared(rig):
    return prepare_periodic(rig)


@pytest.fixture(scope="module")
def finely_prepared(rig):
    return prepare_periodic(rig, samples_per_tooth=256)


@pytest.fixture(scope="module")
def errors():
    return 5e-6 * np.random.default_rng(1).standard_normal(12)


def static_force():
    """W = T / (r cos(phi) cos(psi)) at the mean pitch radius of the NASA rig."""
    radius = 0.0049407 * 6 - 0.0127 * np.sin(np.arctan(1 / 3))
    return 356.05 / (radius * np.cos(np.deg2rad(22.5)) * np.cos(np.deg2rad(35)))


def held(values, n):
    """What n samples hold of periodic values on another grid, coarse or fine: harmonics below n / 2."""
    spectrum = np.fft.rfft(values)[..., : (n + 1) // 2]
    spectrum = spectrum[..., : (values.shape[-1] + 1) // 2] * (n / values.shape[-1])
    return np.fft.irfft(spectrum, n=n)


def solved_in_all_harmonics(rig, gear, damage, errors, samples_per_tooth=64):
    """Compression and signals by harmonic balance, every harmonic of the revolution with every other.

    ``delta_h + H_h sum_i kappa_(h-i) delta_i = delta_s,h + H_h g_h`` for all |h| < n / 2, with the Fourier coefficients
    of the damaged stiffness from a grid 16 times finer.
    """
    teeth = rig.gears[gear].teeth
    n, finer = samples_per_tooth * teeth, 16
    system, mesh = modal_system(rig), rig.meshes["main"]
    speed = abs(rig.speed(rig.gears[gear].shaft))
    u = np.arange(finer * n) / (finer * samples_per_tooth)
    k = np.fft.fft(tooth_stiffness(mesh, teeth, u, damage)) / len(u)
    kappa = k.sum(axis=0)
    kappa[0] -= mesh.stiffness

    h = np.arange(1 - (n + 1) // 2, (n + 1) // 2)
    transfer = system.transfer(speed * np.abs(h))
    transfer[h < 0] = transfer[h < 0].conj()
    H, g = transfer[:, 0, 0], errors @ k[:, h]
    static = np.where(h == 0, transfer[:, :, 1].T, 0)
    K = toeplitz(kappa[: len(h)], kappa[-np.arange(len(h))])
    delta = np.linalg.solve(np.eye(len(h)) + H[:, None] * K, static[0] + H * g)
    spectrum = static + transfer[:, :, 0].T * (g - K @ delta)
    samples = np.exp(2j * np.pi / n * np.outer(h, np.arange(n)))
    compression, *signals = (spectrum @ samples).real
    return compression, np.array(signals)


def scaled(actual, expected):
    """Greatest difference relative to the peak-to-peak of what is expected, a signal a row."""
    return (np.abs(actual - expected).max(axis=-1) / np.ptp(expected, axis=-1)).max()


@pytest.mark.parametrize("name", DAMAGES)
def test_the_small_system_gives_what_the_full_one_does(rig, prepared, errors, monkeypatch, name):
    """With the alias of the damage left in to the estimated error, and with it taken out to what 8 times finer holds.

    Alias is the damage's harmonic content beyond the grid, which falls as h^-3: 8 times finer takes 8^3 of it away.
    """
    references = [(e, *solved_in_all_harmonics(rig, "pinion", DAMAGES[name], e)) for e in (np.zeros(12), errors)]
    for tolerance in (periodic.TOLERANCE, 1e-7):
        monkeypatch.setattr(periodic, "TOLERANCE", tolerance)
        state = prepared.steady_state([DAMAGES[name]])[0]
        within = {"healthy": 1e-12}.get(name, 1e-7 if tolerance == 1e-7 else 1.3 * state.error)
        for e, compression, signals in references:
            assert scaled(state.compression + state.compression_response @ e, compression) < within
            assert scaled(state.signals + state.specimen_response @ e, signals) < within


def test_damage_on_the_driven_gear_gives_what_the_full_system_does(rig, monkeypatch):
    """A revolution of the gear has 36 passes."""
    monkeypatch.setattr(periodic, "TOLERANCE", 1e-6)
    damage = Damage(tooth=36, damaged_teeth=2, stiffness_loss=0.4, phase_shift_deg=-0.5).on_teeth(36)
    e = 5e-6 * np.random.default_rng(2).standard_normal(36)
    state = prepare_periodic(rig, gear="gear", samples_per_tooth=24).steady_state([damage])[0]
    assert state.signals.shape == (2, 24 * 36)
    assert state.specimen_response.shape == (2, 24 * 36, 36)
    compression, signals = solved_in_all_harmonics(rig, "gear", damage, e, samples_per_tooth=24)
    assert scaled(state.compression + state.compression_response @ e, compression) < 1e-6
    assert scaled(state.signals + state.specimen_response @ e, signals) < 1e-6


def test_a_healthy_gear_gives_three_revolutions_of_the_healthy_pinion(rig, prepared):
    by_gear, by_pinion = prepare_periodic(rig, gear="gear").steady_state([{}])[0], prepared.steady_state([{}])[0]
    assert_allclose(by_gear.compression, np.tile(by_pinion.compression, 3), rtol=1e-9)
    assert scaled(by_gear.signals, np.tile(by_pinion.signals, (1, 3))) < 1e-8


def test_the_healthy_response_repeats_every_tooth_pass(prepared):
    """Only mesh harmonics hold energy: every 12th order."""
    state = prepared.steady_state([{}])[0]
    for row in (state.compression, *state.signals):
        energy = np.abs(np.fft.rfft(row)) ** 2
        other = np.delete(energy, np.arange(0, len(energy), 12))
        assert other.sum() < 1e-18 * energy[12:].sum()


@pytest.mark.parametrize("name", DAMAGES)
def test_the_mean_mesh_force_carries_the_torque_whatever_the_damage_and_index_errors(
    prepared, errors, monkeypatch, name
):
    """Stiffness 8 times finer than the compression, so that their product has no alias; on the samples it has."""
    assert_allclose(prepared.steady_state([DAMAGES[name]])[0].mesh_force.mean(), static_force(), rtol=5e-6)
    monkeypatch.setattr(periodic, "TOLERANCE", 1e-7)
    state = prepared.steady_state([DAMAGES[name]])[0]
    by_tooth = tooth_stiffness(prepared.meshes[0], 12, np.arange(6144) / 512, DAMAGES[name])
    for e in (np.zeros(12), errors):
        compression = held(state.compression + state.compression_response @ e, 6144)
        force = (by_tooth * (compression - e[:, None])).sum(axis=0)
        assert_allclose(force.mean(), static_force(), rtol=1e-7)


@pytest.mark.parametrize("name", DAMAGES)
def test_velocity_and_acceleration_have_no_mean(prepared, name):
    state = prepared.steady_state([DAMAGES[name]])[0]
    assert_allclose(state.signals.mean(axis=1) / np.ptp(state.signals, axis=1), 0, atol=1e-6)


def test_static_values_are_those_of_the_mean_stiffness(prepared):
    state = prepared.steady_state([{}])[0]
    assert_allclose(state.static_compression, static_force() / 2.2e8, rtol=1e-6)
    assert_allclose(state.min_compression, state.compression.min() * 2.2e8 / static_force(), rtol=1e-6)


def test_a_common_index_error_of_all_teeth_only_moves_the_train(prepared):
    """Every tooth late by the same amount: the train turns by that much and nothing vibrates more or less."""
    for damage in ({}, DAMAGES["loss"]):
        state = prepared.steady_state([damage])[0]
        moved = state.specimen_response.sum(axis=2)
        size = np.abs(state.specimen_response).max(axis=(1, 2))
        assert_allclose(np.abs(moved).max(axis=1) / size, 0, atol=1e-6)
        assert_allclose(state.compression_response.sum(axis=1), 1, rtol=1e-6)


def test_the_response_is_proportional_to_torque_without_index_errors(rig, prepared):
    double = prepare_periodic(rig.replace({"operating.torque": 712.1})).steady_state([DAMAGES["loss"]])[0]
    single = prepared.steady_state([DAMAGES["loss"]])[0]
    assert scaled(double.signals, 2 * single.signals) < 1e-9
    assert scaled(double.specimen_response[0].T, single.specimen_response[0].T) < 1e-9


@pytest.mark.parametrize("tooth", [2, 7, 12])
def test_damage_at_another_tooth_turns_the_response(prepared, errors, tooth):
    """The row with damage at tooth t is roll(y_D + Y_D roll(e, -(t-1)), (t-1) n/teeth)."""
    one = ToothDamage(phase_shift_deg=2.0, stiffness_loss=0.5, loss_extent=0.6)
    template, there = prepared.steady_state([{1: one}])[0], prepared.steady_state([{tooth: one}])[0]
    turned_errors = np.roll(errors, -(tooth - 1))
    turned = np.roll(template.signals + template.specimen_response @ turned_errors, (tooth - 1) * 64, axis=1)
    assert scaled(there.signals + there.specimen_response @ errors, turned) < 1e-9
    compression = np.roll(template.compression + template.compression_response @ turned_errors, (tooth - 1) * 64)
    assert scaled(there.compression + there.compression_response @ errors, compression) < 1e-9


@pytest.mark.parametrize("name", ["healthy", "loss", "shift"])
def test_64_samples_a_tooth_are_converged_at_both_sensors(prepared, finely_prepared, name):
    """Against 256 samples a tooth, below 1e-4 of the peak-to-peak."""
    fine = finely_prepared.steady_state([DAMAGES[name]])[0]
    state = prepared.steady_state([DAMAGES[name]])[0]
    assert scaled(state.signals, fine.signals[:, ::4]) < 1e-4
    assert scaled(state.compression, fine.compression[::4]) < 1e-4


def test_the_error_falls_faster_than_second_order_with_samples_a_tooth(rig):
    fine = prepare_periodic(rig, samples_per_tooth=128).steady_state([DAMAGES["loss"]])[0]
    errors = [
        scaled(
            prepare_periodic(rig, samples_per_tooth=m).steady_state([DAMAGES["loss"]])[0].signals,
            fine.signals[:, :: 128 // m],
        )
        for m in (16, 32, 64)
    ]
    assert errors[1] < errors[0] / 4
    assert errors[2] < errors[1] / 4


def test_a_small_damage_changes_little_and_no_damage_nothing(prepared):
    healthy = prepared.steady_state([{}])[0]
    nothing = prepared.steady_state([{4: ToothDamage()}])[0]
    small = prepared.steady_state([{4: ToothDamage(stiffness_loss=1e-6)}])[0]
    assert_allclose(nothing.signals, healthy.signals, rtol=0, atol=1e-9 * np.abs(healthy.signals).max())
    change = scaled(small.signals, healthy.signals)
    assert 1e-8 < change < 1e-5


def test_a_gear_without_mesh_or_of_another_rig_is_refused(rig):
    with pytest.raises(InputError, match=r"gear = 'wheel' does not exist; known: pinion, gear"):
        prepare_periodic(rig, gear="wheel")
    data = rig.model_dump()
    by_numbers = {"mass": 3.1, "polar_inertia": 0.01} | dict.fromkeys(("body_length", "material"))
    by_numbers |= {"sources": {}, "assumed": {}}
    data["gears"]["spare"] = data["gears"]["gear"] | {"node": 5} | by_numbers
    with pytest.raises(InputError, match=r"gear 'spare' of rig 'nasa-spiral-bevel' takes part in no mesh; name a gear"):
        prepare_periodic(type(rig).model_validate(data), gear="spare")


def test_damage_of_a_gear_in_two_meshes_is_refused(rig):
    data = rig.model_dump()
    data["meshes"]["second"] = data["meshes"]["main"]
    with pytest.raises(InputError, match=r"gear 'pinion' of rig .* takes part in 2 meshes; damage is simulated in one"):
        prepare_periodic(type(rig).model_validate(data)).steady_state([{1: ToothDamage(stiffness_loss=0.3)}])
