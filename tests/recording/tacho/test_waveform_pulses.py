"""Verification: pulses of waveforms that drift, with spikes, upside down, or of changing height."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.recording.tacho.waveform import Waveform
from sigdb.recording.tacho.waveform_pulses import waveform_pulses
from sigdb.signature import tacho_pulses

FS = 2000.0


@pytest.fixture
def clean(shaft):
    """A waveform with 158 pulses, 0 to 1, in noise of 1 %."""
    at = shaft("wandering")
    times = at.marks()[1:-1]
    return times, at.waveform(times, FS) + 0.01 * np.random.default_rng(0).normal(size=16_000)


def test_a_steady_waveform_gives_the_pulses_of_its_extremes(clean):
    times, x = clean
    found = waveform_pulses(x, FS, pulses_per_rev=1)
    np.testing.assert_array_equal(found.times, tacho_pulses(x, FS))
    assert_allclose(found.times, times, atol=0.2 / FS)
    assert (found.local, found.edge, len(found.spikes)) == (False, "rising", 0)


T = np.arange(16_000) / FS
DRIFTS = {
    "one height": T / 8,
    "down by two heights": -2 * T / 8,
    "back and forth": 1.5 * np.sin(2 * np.pi * 0.2 * T),
    "twenty heights": 20 * T / 8,
    "a step": np.where(T > 5, 3.0, 0.0),
}


@pytest.mark.parametrize("drift", DRIFTS.values(), ids=DRIFTS.keys())
def test_a_drift_hides_no_pulse(clean, drift):
    times, x = clean
    found = waveform_pulses(x + drift, FS, pulses_per_rev=1)
    near = np.abs(found.times - times[np.argmin(np.abs(found.times[:, None] - times), axis=1)])
    assert abs(found.times.size - times.size) <= 3  # the step may add or hide some
    assert np.sum(near > 0.5 / FS) <= 1


@pytest.mark.parametrize("height", [13.0, 3.0, -6.0])
@pytest.mark.parametrize("places", [[9050], [50, 9051, 15_930], [9050, 9051, 9052]])
def test_a_spike_hides_no_pulse_and_is_named(clean, height, places):
    times, x = clean
    x[places] += height
    found = waveform_pulses(x, FS, pulses_per_rev=1)
    assert_allclose(found.times[np.argmin(np.abs(found.times[:, None] - times), axis=0)], times, atol=0.3 / FS)
    assert found.times.size <= times.size + len(places)
    assert found.local
    assert found.spikes[0] == pytest.approx(places[0] / FS)
    assert found.spike_height == pytest.approx(abs(height), rel=0.4)


def test_upside_down_the_short_low_state_is_the_pulse(clean):
    times, x = clean
    found = waveform_pulses(5 - 3 * x, FS, pulses_per_rev=1)
    assert found.edge == "falling"
    assert found.high_share == pytest.approx(1 - 0.004 * 20, abs=0.02)
    assert_allclose(found.times, times, atol=0.2 / FS)
    rising = waveform_pulses(5 - 3 * x, FS, pulses_per_rev=1, edge="rising")
    assert_allclose(rising.times, times + 0.004, atol=0.2 / FS)


def test_half_and_half_the_rising_edge_counts(shaft):
    turns = shaft("steady").angle(T)
    found = waveform_pulses(np.sin(2 * np.pi * turns), FS, pulses_per_rev=1)
    assert found.edge == "rising"
    assert_allclose(found.times[1:], np.arange(1, 160)[: found.times.size - 1] / 20 + found.times[0], atol=1e-5)


def test_an_inductive_pickup_grows_with_the_speed(shaft):
    at = shaft("run-up")
    turns = at.angle(T)
    speed = np.interp(T, at.t, at.speed)
    x = speed * np.sin(2 * np.pi * turns) + 0.05 * np.random.default_rng(1).normal(size=T.size)
    found = waveform_pulses(x, FS, pulses_per_rev=1)
    wanted = at.marks()[1:]
    # The last mark is at the record's end.
    assert_allclose(found.times, wanted[: found.times.size], atol=1.0 / FS)
    assert found.times.size >= wanted.size - 1


def test_options_are_kept_to_the_letter(clean):
    _, x = clean
    for options in ({"threshold": 0.3, "hysteresis": 0.1}, {"threshold": 0.8, "hysteresis": 0.6}):
        found = waveform_pulses(x, FS, pulses_per_rev=1, edge="rising", **options)
        np.testing.assert_array_equal(found.times, tacho_pulses(x, FS, **options))
        falling = waveform_pulses(x, FS, pulses_per_rev=1, edge="falling", **options)
        np.testing.assert_array_equal(
            falling.times, tacho_pulses(-x, FS, threshold=-options["threshold"], hysteresis=options["hysteresis"])
        )
    assert waveform_pulses(x, FS, pulses_per_rev=1, threshold=7.0).times.size == 0
    deep = waveform_pulses(x, FS, pulses_per_rev=1, hysteresis=0.3, edge="rising")
    middle = (x.max() + x.min()) / 2
    np.testing.assert_array_equal(deep.times, tacho_pulses(x, FS, threshold=middle, hysteresis=0.3))


@pytest.mark.parametrize("x", [np.zeros(500), np.zeros(3), np.ones(1)])
def test_a_dead_tacho_has_no_pulses(x):
    assert waveform_pulses(x, FS, pulses_per_rev=1).times.size == 0


def test_levels_that_follow_are_not_computed_for_even_pulses(monkeypatch):
    monkeypatch.setattr(Waveform, "percentiles", lambda *_: pytest.fail("percentiles take a sort"))
    x = 5.0 * (np.arange(int(20 * FS)) / FS * 25 % 1 < 0.1)
    assert len(waveform_pulses(x, FS, pulses_per_rev=1).times) == pytest.approx(500, abs=1)
