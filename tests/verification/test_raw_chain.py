"""Verification: raw signal, tacho, averaging give back the periodic signal that the march repeats."""

import numpy as np
import pytest

from sigdb.core.errors import InputError
from sigdb.dynamics import TimeProfile, march, prepare_periodic
from sigdb.signature import synchronous_average
from sigdb.transmission import Damage, load_transmission

RATE = 100e3
DAMAGE = Damage(tooth=6, stiffness_loss=0.4, phase_shift_deg=1.0)


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


@pytest.fixture(scope="module")
def prepared(rig):
    return prepare_periodic(rig)


def averaged(history, sensor, **options):
    return synchronous_average(history.signals[sensor], RATE, history.pulse_times, samples_per_rev=768, **options)


@pytest.mark.parametrize("pulses", [1, 7])
def test_the_average_of_the_raw_signal_is_the_periodic_one(rig, prepared, pulses):
    """Up to the order that the sampling rate and its filter pass."""
    errors = 2e-6 * np.random.default_rng(3).standard_normal(12)
    start = prepared.modal_state(DAMAGE.on_teeth(12), errors)
    history = march(
        rig,
        DAMAGE,
        duration=33 / 240,
        sampling_rate=RATE,
        index_errors=errors,
        state=start,
        pulses_per_revolution=pulses,
        steps_per_tooth=1024,
    )
    state = prepared.steady_state([DAMAGE.on_teeth(12)])[0]
    clean = state.signals + state.specimen_response @ errors
    passed = np.arange(385) * 240 < 0.35 * RATE
    for sensor, expected in zip(rig.sensors, clean, strict=True):
        found = averaged(history, sensor, pulses_per_rev=pulses, revolutions=30)
        difference = np.fft.rfft(found.tsa - expected)[passed]
        assert np.abs(difference).max() < 2e-4 * np.abs(np.fft.rfft(expected)[1:]).max()
        # All revolutions are alike: what scatters is what the sampling does not hold, and the record's ends.
        assert found.scatter[100:-100].max() < 1e-3 * np.ptp(expected)


def test_the_average_over_the_gear_holds_three_passes_of_the_damaged_tooth(rig, prepared):
    """The tacho is on the pinion; the gear's shaft makes 12/36 of its revolutions."""
    history = march(
        rig,
        DAMAGE,
        duration=33 / 240,
        sampling_rate=RATE,
        state=prepared.modal_state(DAMAGE.on_teeth(12), np.zeros(12)),
        steps_per_tooth=512,
    )
    clean = prepared.steady_state([DAMAGE.on_teeth(12)])[0].signals[0]
    found = averaged(history, "pinion-vertical", ratio=12 / 36, revolutions=10).tsa
    orders = np.abs(np.fft.rfft(found)) / 768
    thrice = orders[: 3 * 90 : 3]  # 768 samples hold orders of the gear up to 288 flat
    np.testing.assert_allclose(thrice, np.abs(np.fft.rfft(clean))[: len(thrice)] / 768, atol=3e-4 * orders[1:].max())
    others = np.delete(orders[:270], np.arange(0, 270, 3))
    assert others.max() < 1e-3 * orders[1:].max()


def test_averaging_by_angle_follows_a_speed_that_drifts(rig, prepared):
    """3 % up and down within the record: by the tacho the average stays; by a fixed time it is smeared."""
    start = prepared.modal_state(DAMAGE.on_teeth(12), np.zeros(12))
    drift = TimeProfile([0.0, 0.05, 0.1, 0.15], [14400.0, 14832.0, 13968.0, 14400.0])
    options = {"duration": 0.15, "sampling_rate": RATE, "state": start}
    history = march(rig, DAMAGE, speed_rpm=drift, **options)
    clean = prepared.steady_state([DAMAGE.on_teeth(12)])[0].signals[0]
    by_angle = averaged(history, "pinion-vertical", revolutions=33).tsa
    by_time = synchronous_average(
        history.signals["pinion-vertical"], RATE, np.arange(34) / 240, samples_per_rev=768, revolutions=33
    ).tsa
    size = np.ptp(clean)
    assert np.abs(by_angle - clean).max() < 0.15 * size
    assert np.abs(by_time - clean).max() > 0.4 * size


def test_a_record_without_a_whole_revolution_is_refused(rig):
    history = march(rig, duration=0.5 / 240, sampling_rate=RATE)
    assert len(history.pulse_times) == 1
    with pytest.raises(InputError, match="pulse_times"):
        averaged(history, "pinion-vertical")
