"""Pulses of a tacho's waveform, and of a mesh harmonic, at times that are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.signature import (
    MeshPhase,
    SynchronousAverager,
    TachoDetector,
    mesh_pulses,
    synchronous_average,
    tacho_pulses,
)


def trapezoids(starts, samples, rise=6.0, length=40.0):
    """Pulses from 0 to 1 that rise in a straight line from each start."""
    t = np.arange(samples)[:, None] - np.asarray(starts)
    return np.clip(np.minimum(t / rise, (length - t) / rise), 0, 1).sum(axis=1)


STARTS = 20 + np.cumsum([100.3, 99.1, 98.77, 101.0, 100.5, 97.25])


@pytest.mark.parametrize("threshold", [0.25, 0.5, 0.75])
def test_a_crossing_lies_between_samples(threshold):
    # The flank is straight, so that the crossing on the line between two samples is exact.
    waveform = trapezoids(STARTS, 800)
    found = tacho_pulses(waveform, 50.0, threshold=threshold, hysteresis=0.2)
    assert_allclose(found, (STARTS + 6 * threshold) / 50, rtol=1e-13)


def test_by_default_half_way_between_the_extremes():
    waveform = 7.0 - 3.0 * trapezoids(STARTS, 800)
    assert_allclose(tacho_pulses(-waveform, 1.0), STARTS + 3.0, rtol=1e-13)
    # Falling edges of the one are rising edges of the other, 40 - 6/2 samples after the start.
    assert_allclose(tacho_pulses(waveform, 1.0), STARTS + 37.0, rtol=1e-13)


def test_a_sine_crosses_at_its_zeros():
    t = np.arange(5000) / 1000
    found = tacho_pulses(np.sin(2 * np.pi * 7 * (t - 0.05)), 1000.0)
    # The straight line's error at an inflection is of third order: below (2 pi 7 / 1000)^2 / 16 of a sample.
    assert_allclose(found, 0.05 + np.arange(35) / 7, atol=2e-7)


def test_noise_below_the_hysteresis_makes_no_pulses():
    noise = 0.2 * np.random.default_rng(0).uniform(-1, 1, size=800)
    waveform = trapezoids(STARTS, 800, rise=60.0, length=90.0) + noise
    assert tacho_pulses(waveform, 1.0, threshold=0.5, hysteresis=0.41).size == STARTS.size
    assert tacho_pulses(waveform, 1.0, threshold=0.5, hysteresis=1e-3).size > STARTS.size


def test_a_pulse_needs_the_waveform_low_before():
    assert tacho_pulses([5.0, 5.0, 0.0, 0.7, 0.0], 1.0, threshold=1.0, hysteresis=0.5).size == 0
    assert_allclose(tacho_pulses([5.0, 0.6, 5.0, 0.4, 5.0], 1.0, threshold=1.0, hysteresis=0.5), [3 + 0.6 / 4.6])


def test_a_sample_on_the_threshold_is_a_crossing():
    assert_array_equal(tacho_pulses([0.0, 1.0, 2.0, 0.0, 1.0], 1.0, threshold=1.0, hysteresis=0.5), [1.0, 4.0])


@pytest.mark.parametrize("level", [0.0, 3.0])
def test_a_constant_has_no_pulses(level):
    assert tacho_pulses(np.full(50, level), 1.0).shape == (0,)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_blocks_give_the_same_pulses(seed):
    rng = np.random.default_rng(seed)
    waveform = np.cumsum(rng.normal(size=500))
    whole = tacho_pulses(waveform, 20.0, threshold=0.3, hysteresis=0.5)
    detector = TachoDetector(20.0, threshold=0.3, hysteresis=0.5)
    cuts = np.sort(rng.integers(1, 500, size=rng.integers(0, 30)))
    blocks = [detector.push(part) for part in np.split(waveform, np.unique(cuts))]
    assert_allclose(np.concatenate(blocks), whole, rtol=1e-13)


def test_tachos_and_averages_stream_together():
    fs, speed = 2000.0, 9.7
    theta = 2 * np.pi * speed * np.arange(60_000) / fs
    detector = TachoDetector(fs, threshold=0.0, hysteresis=0.3)
    averager = SynchronousAverager(fs, samples_per_rev=128)
    for block in np.split(theta, 12):
        averager.push(np.cos(8 * block), detector.push(np.sin(block)))
    average = averager.result()
    assert average.revolutions == 289
    assert_allclose(average.tsa, np.cos(8 * 2 * np.pi * np.arange(128) / 128), atol=1e-4)


def test_what_a_waveform_must_be():
    with pytest.raises(InputError, match=r"^tacho_pulses: waveform of shape \(2, 50\) must have one axis; pass one"):
        tacho_pulses(np.zeros((2, 50)), 1.0)
    for bad in ([], [np.nan], [1j], 3.0):
        with pytest.raises(InputError, match=r"^tacho_pulses: waveform "):
            tacho_pulses(bad, 1.0)
    with pytest.raises(InputError, match=r"^tacho_pulses: fs = 0 must be above 0"):
        tacho_pulses([1.0], 0)
    with pytest.raises(InputError, match=r"^tacho_pulses: hysteresis = 0.0 must be above 0"):
        tacho_pulses([1.0], 1.0, hysteresis=0.0)
    with pytest.raises(InputError, match=r"^tacho_pulses: threshold = nan must be a finite number"):
        tacho_pulses([1.0], 1.0, threshold=np.nan)


FS, SAMPLES = 5000.0, 40_000
T = np.arange(SAMPLES) / FS
TEETH = 12


def passes(found, turned):
    """By how many tooth passes the shaft had turned at the times found."""
    return TEETH * np.interp(found, T, turned)


def assert_at_crests(found, turned, error, harmonic=1):
    """One pulse a tooth pass, each at a crest of the harmonic, and none missing between the ends."""
    turns = passes(found, turned)
    assert_allclose(np.diff(turns), 1, atol=2 * error)
    assert_allclose(harmonic * turns, np.round(harmonic * turns), atol=error)
    assert found.size > TEETH * (np.ptp(turned) - 3.2)


def test_the_passes_of_a_steady_mesh():
    turned = 10.3 * T + 0.123
    found = mesh_pulses(np.cos(2 * np.pi * TEETH * turned), FS, teeth=TEETH, mesh_frequency=10.3 * TEETH)
    assert_at_crests(found, turned, 2e-4)  # at the ends, where the band rings; not within
    inner = passes(found, turned)[60:-60]
    assert_allclose(inner, np.round(inner), atol=1e-9)


@pytest.mark.parametrize("guess", [0.99, 1.01])
def test_a_guess_of_the_frequency_is_corrected(guess):
    turned = 10.3 * T + 0.123
    found = mesh_pulses(np.cos(2 * np.pi * TEETH * turned), FS, teeth=TEETH, mesh_frequency=guess * 10.3 * TEETH)
    # The record's ends, where the window reaches out of it, still show in the passes next to them.
    assert_at_crests(found, turned, 2e-3)
    inner = passes(found, turned)[60:-60]
    assert_allclose(inner, np.round(inner), atol=1e-6)


def test_sidebands_and_other_harmonics_do_not_bend_the_angle():
    # The sidebands and the second harmonic lie on zeros of the window, as the speed is steady.
    theta = 2 * np.pi * 10 * T
    x = (1 + 0.5 * np.cos(theta + 1) + 0.3 * np.cos(2 * theta)) * np.cos(TEETH * theta) + 0.8 * np.cos(
        2 * TEETH * theta
    )
    found = mesh_pulses(x, FS, teeth=TEETH, mesh_frequency=120.0)
    assert_at_crests(found, 10 * T, 1e-4)


@pytest.mark.parametrize("harmonic", [2, 3])
def test_a_higher_harmonic_counts_teeth_all_the_same(harmonic):
    turned = 10.3 * T + 0.01 * np.sin(2 * np.pi * 0.5 * T)
    x = np.cos(2 * np.pi * harmonic * TEETH * turned)
    found = mesh_pulses(x, FS, teeth=TEETH, mesh_frequency=10.3 * TEETH, harmonic=harmonic)
    assert_at_crests(found, turned, 1e-2, harmonic)


def test_a_run_up_with_a_guess_for_each_sample():
    # From 8 to 16 rev/s: far outside any one band.
    turned, rate = 8 * T + T**2 / 2, 8 + T
    found = mesh_pulses(np.cos(2 * np.pi * TEETH * turned), FS, teeth=TEETH, mesh_frequency=TEETH * 1.004 * rate)
    assert_at_crests(found, turned, 1e-3)


def test_changes_of_speed_are_followed():
    # The speed swings once a second, with ten revolutions in that time, by 3 %.
    turned = 10 * T + 0.05 * np.sin(2 * np.pi * T)
    found = mesh_pulses(np.cos(2 * np.pi * TEETH * turned), FS, teeth=TEETH, mesh_frequency=120.0)
    assert_at_crests(found, turned, 4e-3)


def test_an_average_without_a_tacho():
    turned = 10 * T + 0.05 * np.sin(2 * np.pi * 0.3 * T)
    theta = 2 * np.pi * turned
    x = np.cos(TEETH * theta) + 0.4 * np.cos(17 * theta + 1.0) + np.random.default_rng(0).normal(size=SAMPLES)
    found = mesh_pulses(x, FS, teeth=TEETH, mesh_frequency=120.0)
    average = synchronous_average(x, FS, found, pulses_per_rev=TEETH, samples_per_rev=768)
    spectrum = np.abs(np.fft.rfft(average.tsa)) * 2 / 768
    # Noise of unit variance over 79 revolutions of 500 samples: 0.01 in each amplitude.
    assert_allclose(spectrum[[12, 17]], [1.0, 0.4], atol=0.04)


def test_a_guess_at_a_few_times_is_linear_between_them():
    turned, rate = 8 * T + T**2 / 2, 8 + T
    x = np.cos(2 * np.pi * TEETH * turned) + 0.5 * np.cos(2 * np.pi * 2 * TEETH * turned)
    guess = 1.002 * TEETH * np.array([8.0, 16.0])
    few = MeshPhase(x, FS, teeth=TEETH, mesh_frequency=guess, times=[0.0, 8.0])
    each = MeshPhase(x, FS, teeth=TEETH, mesh_frequency=1.002 * TEETH * rate)
    for harmonic in (1, 2):
        assert_at_crests(few.pulses(harmonic), turned, 2e-3, harmonic)
        assert_allclose(few.pulses(harmonic), each.pulses(harmonic), atol=1e-9)


def test_a_guess_is_constant_beyond_its_times():
    x = np.cos(2 * np.pi * TEETH * 10 * T)
    found = MeshPhase(x, FS, teeth=TEETH, mesh_frequency=[120.5, 120.5], times=[3.0, 4.0]).pulses()
    assert_allclose(found, mesh_pulses(x, FS, teeth=TEETH, mesh_frequency=120.5), atol=1e-12)


def test_an_offset_does_not_bend_the_angle():
    noise = np.random.default_rng(2).normal(size=SAMPLES)
    x = np.cos(2 * np.pi * TEETH * 10 * T) + noise
    plain, raised = (mesh_pulses(x + c, FS, teeth=TEETH, mesh_frequency=120.0) for c in (0.0, 1e6))
    assert_allclose(raised, plain, atol=1e-7)


@pytest.mark.parametrize(
    ("frequency", "times", "message"),
    [
        ([120.0, 121.0], [0.0], r"mesh_frequency of shape \(2,\) must be one number or one for each time"),
        ([120.0, 121.0], [1.0, 0.0], "times"),
    ],
)
def test_times_of_a_guess_rise_and_have_a_value_each(frequency, times, message):
    with pytest.raises(InputError, match=message):
        MeshPhase(np.cos(2 * np.pi * 120 * T), FS, teeth=12, mesh_frequency=frequency, times=times)


def test_what_a_mesh_must_be():
    x = np.cos(2 * np.pi * 120 * T)
    options = {"teeth": 12, "mesh_frequency": 120.0}
    with pytest.raises(InputError, match=r"^mesh_pulses: x of shape \(2, 40000\) must have one axis; pass one channel"):
        mesh_pulses(np.stack([x, x]), FS, **options)
    with pytest.raises(InputError, match=r"^mesh_pulses: x must be finite"):
        mesh_pulses(np.where(T == 0, np.nan, x), FS, **options)
    for frequency in (0.0, 2500.0, np.nan):
        with pytest.raises(
            InputError, match=r"^mesh_pulses: mesh_frequency from .* must be above 0 and, times harmonic"
        ):
            mesh_pulses(x, FS, teeth=12, mesh_frequency=frequency)
    for frequency in ([120.0, 121.0], "120"):
        with pytest.raises(InputError, match=r"^mesh_pulses: mesh_frequency of shape .* must be one number or one for"):
            mesh_pulses(x, FS, teeth=12, mesh_frequency=frequency)
    with pytest.raises(InputError, match=r"^mesh_pulses: mesh_frequency .* times harmonic = 21, below fs/2 = 2500 Hz"):
        mesh_pulses(x, FS, **options, harmonic=21)
    with pytest.raises(
        InputError, match=r"^mesh_pulses: x of 1000 samples must be longer than the 1501 that a bandwidth"
    ):
        mesh_pulses(x[:1000], FS, **options)
    with pytest.raises(InputError, match=r"^mesh_pulses: bandwidth = -1 must be above 0"):
        mesh_pulses(x, FS, **options, bandwidth=-1)


def test_a_harmonic_that_is_not_there():
    noise = np.random.default_rng(0).normal(size=SAMPLES)
    with pytest.raises(InputError, match="the phase of mesh harmonic 1 runs backwards; check mesh_frequency, take a"):
        mesh_pulses(noise, FS, teeth=12, mesh_frequency=120.0, bandwidth=400.0)
