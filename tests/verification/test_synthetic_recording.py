"""Verification: what averaging makes of a synthetic recording is the periodic steady state and what was added to it."""

import numpy as np
import pytest

from sigdb.dynamics import Transient, prepare_periodic, simulate
from sigdb.recording import Surroundings, synthetic_recording
from sigdb.signature import synchronous_average, tacho_pulses
from sigdb.transmission import Damage, load_transmission

RATE, REVOLUTIONS = 204.8e3, 30
DAMAGE = Damage(tooth=6, stiffness_loss=0.4, phase_shift_deg=1.0)
ERRORS = 2e-6 * np.random.default_rng(3).standard_normal(12)


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def states(rig):
    """Clean average of the damaged pinion with index errors, and the healthy one."""
    prepared = prepare_periodic(rig)
    state = prepared.steady_state([DAMAGE.on_teeth(12)])[0]
    return state.signals[0] + state.specimen_response[0] @ ERRORS, prepared.steady_state([{}])[0].signals[0]


def recording_of(rig, damage=DAMAGE, errors=ERRORS, **surroundings):
    return synthetic_recording(
        rig,
        damage,
        sampling_rate=RATE,
        revolutions=REVOLUTIONS,
        index_errors=errors,
        surroundings=Surroundings(**surroundings),
        steps_per_tooth=128,
        seed=11,
    )


def average_of(recording, teeth=12, revolutions=REVOLUTIONS):
    tacho = recording.channel(recording.tacho)
    return synchronous_average(
        recording.signals[0].samples,
        tacho.sampling_rate,
        tacho_pulses(tacho.samples, tacho.sampling_rate),
        samples_per_rev=64 * teeth,
        pulses_per_rev=int(recording.pulses_per_rev),
        ratio=recording.ratio,
        revolutions=revolutions,
    )


@pytest.mark.parametrize(
    "tacho",
    [{}, {"pulses_per_revolution": 7}, {"shaft": "gear-shaft"}, {"shaft": "gear-shaft", "pulses_per_revolution": 5}],
)
def test_without_any_ingredient_the_average_is_the_steady_state(rig, states, tacho):
    """Tooth 6 and its index errors in their places, whatever the tacho: its first pulse is the mark."""
    found = average_of(recording_of(rig, tacho=tacho))
    assert np.abs(found.tsa - states[0]).max() < 4e-4 * np.ptp(states[0])
    assert found.scatter.max() < 1e-4 * np.ptp(states[0])


def test_a_mark_of_a_hunting_pair_is_one_of_both_shafts(rig):
    """With 13 and 36 teeth the gear's tacho and the pinion have a common mark once in 36 revolutions."""
    other = rig.replace({"pinion.teeth": 13})
    recording = recording_of(other, errors=None, tacho={"shaft": "gear-shaft"})
    clean = prepare_periodic(other).steady_state([DAMAGE.on_teeth(13)])[0].signals[0]
    found = average_of(recording, teeth=13).tsa
    assert np.abs(found - clean).max() < 4e-4 * np.ptp(clean)


def test_a_tacho_on_the_pinion_counts_the_teeth_of_the_gear(rig):
    """The gear makes a third of the pinion's revolutions; its tooth 20 is where it was put."""
    damage = Damage(gear="gear", tooth=20, stiffness_loss=0.4)
    recording = recording_of(rig, damage, None, tacho={"shaft": "pinion-shaft"})
    clean = prepare_periodic(rig, gear="gear").steady_state([damage.on_teeth(36)])[0].signals[0]
    assert (recording.teeth, recording.ratio) == (36, pytest.approx(1 / 3))
    found = average_of(recording, teeth=36).tsa
    assert np.abs(found - clean).max() < 4e-4 * np.ptp(clean)


def test_noise_leaves_what_the_number_of_revolutions_says(rig, states):
    """Its density in the average is that of the recording: 1 / M of it at the orders that the averaging passes flat."""
    bare, noisy = recording_of(rig), recording_of(rig, noise={"snr_db": -6.0})
    added = noisy.signals[0].samples - bare.signals[0].samples
    sigma = states[1].std() * 10 ** (6 / 20)
    assert added.std() == pytest.approx(sigma, rel=4 / np.sqrt(2 * added.size))
    left = np.fft.rfft(average_of(noisy).tsa - average_of(bare).tsa)[1:251]
    per_order = sigma**2 * 768 / REVOLUTIONS * (768 * 240 / RATE)
    assert np.mean(np.abs(left) ** 2) == pytest.approx(per_order, rel=4 / np.sqrt(250))


def test_tones_of_broken_orders_leave_the_average_and_stay_in_the_scatter(rig, states):
    tones = {"shafts": ({"shaft": "gear-shaft", "harmonics": (1.0, 5.0), "amplitude": 0.8},)}
    found = average_of(recording_of(rig, **tones))
    assert np.abs(found.tsa - states[0]).max() < 4e-4 * np.ptp(states[0])
    rms = np.sqrt(np.mean(found.scatter**2)) / states[1].std()
    assert rms == pytest.approx(0.8 * np.sqrt(REVOLUTIONS / (REVOLUTIONS - 1)), rel=1e-3)


def test_tones_follow_the_angle_of_a_speed_that_drifts(rig, states):
    """The third harmonic of the gear's shaft is of order 1 of the pinion, in the average with its whole amplitude."""
    speed = {"depth": 0.02, "period": 0.1}
    tones = ({"shaft": "gear-shaft", "harmonics": (3.0,), "amplitude": 0.5},)
    toned, bare = (average_of(recording_of(rig, speed=speed, **some)).tsa for some in ({"shafts": tones}, {}))
    orders = 2 * np.abs(np.fft.rfft(toned - bare)) / 768 / states[1].std()
    assert orders[1] == pytest.approx(0.5, rel=1e-3)
    assert np.delete(orders, 1).max() < 1e-3


def test_a_path_multiplies_each_order_by_its_gain(rig, states):
    path = {"frequency": 12e3, "damping_ratio": 0.05, "gain": 0.7}
    found = np.fft.rfft(average_of(recording_of(rig, path=path)).tsa)
    r = 240 * np.array([12, 24, 36]) / 12e3
    expected = 0.7 / (1 - r**2 + 2j * 0.05 * r) * np.fft.rfft(states[0])[[12, 24, 36]]
    # The bilinear transform bends frequencies, most in the middle between 0 and the resonance.
    np.testing.assert_allclose(found[[12, 24, 36]], expected, rtol=0.03)


def test_torque_and_speed_wander_as_they_are_told(rig):
    wander = {"offset": 0.03, "depth": 0.02, "period": 0.05}
    recording = recording_of(rig, speed=wander, torque={"offset": -0.1})
    tacho = recording.channel("tacho")
    rates = 60 / np.diff(tacho_pulses(tacho.samples, RATE))
    assert recording.torque == pytest.approx(0.9 * 356.05)
    assert (rates.min() / 14400, rates.max() / 14400) == (pytest.approx(1.01, abs=1e-3), pytest.approx(1.05, abs=1e-3))


def test_a_mesh_that_loses_contact_says_so(rig):
    damage = Damage(tooth=6, stiffness_loss=0.9, damaged_teeth=2)
    assert simulate(rig, damage, solver=Transient()).contact_loss
    assert "all meshes are closed during" in recording_of(rig, damage, None).notes[0].text
    assert [note.text for note in recording_of(rig).notes] == ["made by the march in time, not measured"]
