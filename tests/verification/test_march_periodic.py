"""Verification: where contact is kept, the march is the periodic solution, to the errors that both state."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics import Periodic, Transient, prepare_periodic, settle, simulate
from sigdb.transmission import Damage, ToothDamage, Transmission, load_transmission

EXCITED = {
    "gears": {
        "pinion": {"unbalance": 5e-5, "unbalance_angle_deg": 30.0, "runout": 1e-6, "runout_angle_deg": 100.0},
        "gear": {"unbalance": 3e-4, "runout": 1e-6},
    },
    "meshes": {"main": {"profile_error": {"amplitude": 3e-6}}},
    "operating": {"load_fluctuation": 0.03, "load_order": 3, "load_angle_deg": 40.0},
}


def excited():
    """The paper's rig with everything that excites a rig."""
    data = load_transmission("nasa-spiral-bevel").model_dump()
    for section in ("gears", "meshes"):
        for name, more in EXCITED[section].items():
            data[section][name] |= more
    data["operating"] |= EXCITED["operating"]
    return Transmission.model_validate(data)


CASES = {
    "healthy": (None, None),
    "loss": (Damage(tooth=6, stiffness_loss=0.3), None),
    "shift": (Damage(tooth=1, phase_shift_deg=2.0), None),
    "friction": (Damage(tooth=12, stiffness_loss=0.3, loss_extent=0.2, friction=0.08), None),
    "errors": (Damage(tooth=3, damaged_teeth=2, stiffness_loss=0.2), 4e-6),
    "driven": (Damage(gear="gear", tooth=36, stiffness_loss=0.3, phase_shift_deg=0.5), 2e-6),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("rig", [load_transmission("nasa-spiral-bevel"), excited()], ids=["quiet", "excited"])
def test_both_solvers_give_one_response_where_contact_is_kept(rig, name):
    damage, size = CASES[name]
    teeth = 36 if name == "driven" else 12
    errors = None if size is None else size * np.random.default_rng(5).standard_normal(teeth)
    found = simulate(rig, damage, index_errors=errors, solver=Transient(steps_per_tooth=128, samples_per_tooth=32))
    expected = simulate(rig, damage, index_errors=errors, solver=Periodic(samples_per_tooth=64))
    assert not found.contact_loss
    assert found.gear == expected.gear
    assert found.units == expected.units
    for sensor, signal in expected.signals.items():
        assert np.abs(found.signals[sensor] - halved(signal)).max() < (found.error + expected.error) * np.ptp(signal)
    assert_allclose(found.compression, expected.compression[::2], rtol=0, atol=4e-3 * np.ptp(expected.compression))
    assert found.error < 3e-3


def halved(signal):
    """Every second sample of a signal without what they cannot hold."""
    spectrum = np.fft.rfft(signal)[: len(signal) // 4 + 1] / 2
    spectrum[-1] = 0
    return np.fft.irfft(spectrum)


def test_both_give_one_response_of_a_spur_rig():
    rig = load_transmission("spur-test-rig")
    damage, errors = Damage(tooth=4, stiffness_loss=0.3), 1e-6 * np.random.default_rng(2).standard_normal(19)
    found = simulate(rig, damage, index_errors=errors, solver=Transient())
    expected = simulate(rig, damage, index_errors=errors)
    assert not found.contact_loss
    for sensor, signal in expected.signals.items():
        assert np.abs(found.signals[sensor] - signal).max() < (found.error + expected.error) * np.ptp(signal)


def test_both_give_one_response_of_a_wide_helical_pair_with_profile_shift():
    """A contact of nearly four passes, with a damaged tooth that carries a quarter of the load at most."""
    data = load_transmission("spur-test-rig").model_dump()
    profile = {"kind": "iso-6336", "flank": 0.2, "profile_shift": [0.2, 0.1]}
    data["meshes"]["main"] |= {"profile": profile, "face_width": 0.06, "helix_angle_deg": 20.0}
    rig = Transmission.model_validate(data)
    assert 3.5 < rig.meshes["main"].profile.contact_ratio < 4
    damage = Damage(gear="pinion", tooth=7, stiffness_loss=0.4)
    found = simulate(rig, damage, solver=Transient(steps_per_tooth=128, samples_per_tooth=32))
    expected = simulate(rig, damage, solver=Periodic(samples_per_tooth=64))
    for sensor, signal in expected.signals.items():
        assert np.abs(found.signals[sensor] - halved(signal)).max() < (found.error + expected.error) * np.ptp(signal)
    assert found.error < 3e-3


def test_both_give_one_average_of_two_stages():
    """Five revolutions close the tooth cycle; damage at the second mesh, which is the first of the tables."""
    rig, gear, damage = load_transmission("two-stage-gearbox"), "middle-pinion", {5: ToothDamage(stiffness_loss=0.3)}
    prepared, none = prepare_periodic(rig, gear=gear, samples_per_tooth=32), np.zeros(rig.gears["middle-pinion"].teeth)
    state = prepared.steady_state([damage], specimens=False)[0]
    solver = Transient(steps_per_tooth=256, samples_per_tooth=32)
    orbit = settle(
        rig,
        gear=gear,
        damage=damage,
        index_errors=none,
        state=prepared.modal_state(damage, none),
        solver=solver,
        system=prepared.system,
    )
    assert len(orbit.compression) == 2
    assert not orbit.contact_loss
    size = np.ptp(state.signals, axis=1)
    assert (np.abs(orbit.signals - state.signals).max(axis=1) < (orbit.error + state.error) * size).all()
    assert_allclose(orbit.static_compression, prepared.static_compression, rtol=1e-9)


def test_extrapolation_in_the_step_is_better_than_second_order():
    """Against the finest: the signals of settle fall by far more than 4 from step to step, the compression by 4."""
    rig, damage = load_transmission("nasa-spiral-bevel"), {6: ToothDamage(stiffness_loss=0.3)}
    prepared, none = prepare_periodic(rig), np.zeros(12)
    state = prepared.modal_state(damage, none)
    found = [
        settle(
            rig,
            gear="pinion",
            damage=damage,
            index_errors=none,
            state=state,
            solver=Transient(steps_per_tooth=steps, samples_per_tooth=16, tolerance=1e-9),
            system=prepared.system,
        )
        for steps in (64, 128, 256, 1024)
    ]
    signal, compression = (
        np.array([np.abs(one - all_[-1]).max() for one in all_[:-1]]) / np.ptp(all_[-1])
        for all_ in ([one.signals[0] for one in found], [one.compression[0] for one in found])
    )
    assert_allclose(np.log2(compression[:-1] / compression[1:]), 2, atol=0.1)
    assert np.log2(signal[0] / signal[1]) > 3.5
    assert (signal < compression / 20).all()
    assert (signal < [2 * one.error for one in found[:-1]]).all()
