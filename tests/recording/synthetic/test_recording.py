"""The ingredients of synthetic recordings, each against its mathematics."""

import numpy as np
import pytest
from scipy.signal import welch

from sigdb.core.errors import InputError
from sigdb.recording import Surroundings, synthetic_recording
from sigdb.recording.synthetic.sensors import (
    SensorResonance,
    coloured_noise,
    jitter_times,
    pulse_waveform,
    through_path,
)
from sigdb.recording.synthetic.surroundings import Drift
from sigdb.recording.synthetic.tones import BearingTones, sum_of_tones
from sigdb.signature import synchronous_average, tacho_pulses
from sigdb.transmission import RollingBearing, load_transmission

RATE = 51.2e3


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel")


def relative_density(frequency, corner_frequency):
    """Power density of coloured noise relative to white noise of the same variance: the autoregression's."""
    a = np.exp(-2 * np.pi * corner_frequency / RATE)
    return (1 - a**2) / np.abs(1 - a * np.exp(-2j * np.pi * frequency / RATE)) ** 2


def test_a_drift_is_an_offset_and_a_sine():
    drift = Drift(offset=-0.05, depth=0.03, period=0.4)
    t = np.linspace(0, 1.0, 5001)
    wanted = 200 * (0.95 + 0.03 * np.sin(2 * np.pi * t / 0.4 + 0.7))
    # A chord of a 64th of a period leaves (pi / 64)^2 / 2 of the amplitude.
    assert np.abs(drift.profile(200.0, duration=1.0, phase=0.7)(t) - wanted).max() <= 200 * 0.03 * (np.pi / 64) ** 2 / 2


def test_a_drift_without_a_sine_is_a_constant():
    assert set(Drift(offset=0.03).profile(100.0, duration=9.0)(np.array([0.0, 3.0, 20.0]))) == {103.0}


def test_a_drift_that_stops_the_shaft_is_refused():
    with pytest.raises(InputError, match=r"offset = -0\.9 and depth = 0\.2 .* keep offset - depth above -1"):
        Drift(offset=-0.9, depth=0.2)


def test_tones_stand_at_their_orders():
    turns = np.arange(4096) / 4096 * 16  # bins of a sixteenth of an order
    x = sum_of_tones(turns, [5.0625, 20.5], [3.0, 0.25], [0.4, -1.0])
    spectrum = 2 * np.fft.rfft(x) / 4096
    np.testing.assert_allclose(spectrum[[81, 328]], [3.0 * np.exp(0.4j), 0.25 * np.exp(-1j)], rtol=1e-10)
    assert np.abs(np.delete(spectrum, [81, 328])).max() < 1e-12


def test_bearing_orders_are_those_published_for_a_6205():
    """Case Western Reserve University's drive-end bearing; its 'rolling element' order counts both races, twice BSF."""
    inch = 0.0254
    bearing = RollingBearing(rolling_elements=9, rolling_diameter=0.3126 * inch, pitch_diameter=1.537 * inch)
    found = [bearing.inner, bearing.outer, bearing.cage, 2 * bearing.spin]
    np.testing.assert_allclose(found, [5.4152, 3.5848, 0.39828, 4.7135], rtol=1e-4)


def test_a_contact_angle_takes_the_cosine():
    flat = RollingBearing(rolling_elements=10, rolling_diameter=0.01, pitch_diameter=0.1)
    steep = RollingBearing(rolling_elements=10, rolling_diameter=0.02, pitch_diameter=0.1, contact_angle_deg=60.0)
    assert steep.outer == pytest.approx(flat.outer) == pytest.approx(4.5)


def test_harmonics_of_a_bearing_fall_with_their_number():
    bearing = RollingBearing(rolling_elements=10, rolling_diameter=0.01, pitch_diameter=0.1)
    tone = BearingTones(bearing=bearing, outer=0.6, inner=0.0, harmonics=3)
    np.testing.assert_allclose(tone.orders[:3], [4.5, 9.0, 13.5])
    np.testing.assert_allclose(tone.amplitudes[:3], [0.6, 0.3, 0.2])
    assert not tone.amplitudes[3:].any()


@pytest.mark.parametrize(("frequency", "damping"), [(3000.0, 0.05), (12e3, 0.2)])
def test_a_path_has_its_gain_at_rest_and_at_resonance(frequency, damping):
    path = SensorResonance(frequency=frequency, damping_ratio=damping, gain=-1.5)
    t = np.arange(40_960) / RATE
    still = through_path(np.full(1000, 2.0), RATE, path)
    np.testing.assert_allclose(still, -3.0, rtol=1e-9)
    x = through_path(np.cos(2 * np.pi * frequency * t), RATE, path)[20_480:]
    late = t[20_480:]
    response = 2 * np.mean(x * np.exp(-2j * np.pi * frequency * late))
    # H(i w0) = gain / (2 i zeta): the phase lags by a quarter.
    np.testing.assert_allclose(response, -1.5 / (2j * damping), rtol=1e-3)


def test_a_path_far_below_its_resonance_is_that_of_one_degree_of_freedom():
    path, f = SensorResonance(frequency=8000.0, damping_ratio=0.1), 2000.0
    t = np.arange(51_200) / 204.8e3
    x = through_path(np.cos(2 * np.pi * f * t), 204.8e3, path)[25_600:]
    response = 2 * np.mean(x * np.exp(-2j * np.pi * f * t[25_600:]))
    np.testing.assert_allclose(response, 1 / (1 - 0.25**2 + 2j * 0.1 * 0.25), rtol=2e-3)


def test_coloured_noise_has_the_variance_and_the_memory_of_its_autoregression():
    x = coloured_noise(np.random.default_rng(0), (400, 2000), RATE, 3000.0)
    a = np.exp(-2 * np.pi * 3000 / RATE)
    products = [np.mean(x[:, k:] * x[:, : 2000 - k]) for k in range(6)]
    np.testing.assert_allclose(products, a ** np.arange(6), atol=0.008)
    # Stationary from the first sample on: 400 of them.
    assert abs(np.mean(x[:, 0] ** 2) - 1) < 4 * np.sqrt(2 / 400)


def test_the_density_of_coloured_noise_is_the_one_stated():
    x = coloured_noise(np.random.default_rng(1), (2_000_000,), RATE, 3000.0)
    f, density = welch(x, RATE, nperseg=1024)
    stated = relative_density(f, 3000.0) / (RATE / 2)
    # Some 3900 segments, half independent: 2 % each.
    np.testing.assert_allclose(density[2:-1], stated[2:-1], rtol=0.12)
    assert np.mean(density[2:-1] / stated[2:-1]) == pytest.approx(1, abs=5e-3)


def test_white_and_coloured_noise_come_from_the_same_numbers():
    white, coloured = (coloured_noise(np.random.default_rng(2), (3, 500), RATE, corner) for corner in (None, 2000.0))
    a = np.exp(-2 * np.pi * 2000 / RATE)
    np.testing.assert_allclose(coloured[:, 1:] - a * coloured[:, :-1], np.sqrt(1 - a**2) * white[:, 1:], atol=1e-12)
    np.testing.assert_allclose(coloured[:, 0], white[:, 0])


def test_pulses_are_found_where_they_were_put():
    times = np.cumsum(np.random.default_rng(3).uniform(0.9e-3, 1.4e-3, 200))
    waveform = pulse_waveform(times, RATE, int((times[-1] + 1e-3) * RATE), width=3e-4)
    assert (waveform.min(), waveform.max()) == (0.0, 1.0)
    np.testing.assert_allclose(tacho_pulses(waveform, RATE), times, atol=1e-12)


def test_jitter_has_its_deviation_and_no_bias():
    times = np.arange(1, 40_001) / 100
    late = jitter_times(np.random.default_rng(4), times, 2e-5) - times
    assert np.std(late) == pytest.approx(2e-5, rel=4 / np.sqrt(2 * 40_000))
    assert abs(np.mean(late)) < 4 * 2e-5 / np.sqrt(40_000)
    assert np.array_equal(jitter_times(np.random.default_rng(4), times, 0.0), times)


def test_jitter_takes_from_a_harmonic_what_the_characteristic_function_says():
    """At the mark only the pulse there counts; between marks the spline has a part of its neighbours too."""
    rate, f, sigma, revolutions = 10e3, 600.0, 6e-5, 1000
    t = np.arange(int((revolutions + 2) * 0.02 * rate)) / rate
    x = np.cos(2 * np.pi * f * t)
    pulses = jitter_times(np.random.default_rng(5), 0.01 + np.arange(revolutions + 1) * 0.02, sigma)
    average = synchronous_average(x, rate, pulses, samples_per_rev=120, revolutions=revolutions)
    kept = np.exp(-((2 * np.pi * f * sigma) ** 2) / 2)
    # cos of a normal phase, averaged over so many revolutions.
    assert average.tsa[0] == pytest.approx(kept * np.cos(2 * np.pi * f * 0.01), abs=4 * 0.04 / np.sqrt(revolutions))


def test_one_ingredient_changes_no_other(rig):
    some = {"noise": {"snr_db": 0.0}, "shafts": ({"shaft": "gear-shaft"},)}
    options = {"sampling_rate": RATE, "revolutions": 3, "seed": 7, "steps_per_tooth": 16}

    def signal(**surroundings):
        return synthetic_recording(rig, surroundings=Surroundings(**surroundings), **options).signals[0].samples

    bare, noisy, toned, both = signal(), signal(noise=some["noise"]), signal(shafts=some["shafts"]), signal(**some)
    np.testing.assert_allclose(both - toned, noisy - bare, atol=1e-12 * np.ptp(both))
    jitter = synthetic_recording(rig, surroundings=Surroundings(tacho={"jitter": 1e-5}), **options)
    assert np.array_equal(jitter.signals[0].samples, bare)
    other = synthetic_recording(rig, surroundings=Surroundings(noise=some["noise"]), **options | {"seed": 8})
    assert not np.array_equal(other.signals[0].samples, noisy)


def test_seconds_are_rounded_up_to_revolutions(rig):
    recording = synthetic_recording(rig, sampling_rate=RATE, seconds=2.1 / 240, steps_per_tooth=16)
    tacho = recording.channel("tacho")
    pulses = tacho_pulses(tacho.samples, RATE)
    # The mark half a revolution after the beginning, three revolutions, and one pulse more for the spline.
    np.testing.assert_allclose(pulses, 0.5 / 240 + np.arange(5) / 240, atol=1 / RATE)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "either revolutions or seconds"),
        ({"revolutions": 3, "seconds": 1.0}, "either revolutions or seconds"),
        ({"revolutions": 3, "sensor": "nothing"}, "sensor = 'nothing' .* name one of pinion-vertical"),
        ({"revolutions": 0}, "revolutions = 0 must be a whole number of at least 1"),
        ({"seconds": -1.0}, r"seconds = -1\.0 must be above zero"),
        ({"revolutions": 3, "damage": "wheel"}, "wheel"),
        ({"revolutions": 3, "surroundings": {"tacho": {"shaft": "nothing"}}}, r"tacho\.shaft = 'nothing' .* name one"),
        ({"revolutions": 3, "surroundings": {"shafts": ({"shaft": "nothing"},)}}, "shaft = 'nothing' .* name one"),
        ({"revolutions": 3, "surroundings": {"shafts": ({"harmonics": (200.0,)},)}}, "a tone of order 200"),
        ({"revolutions": 3, "surroundings": {"path": {"frequency": 30e3}}}, r"path\.frequency, 30000 Hz, is not below"),
        ({"revolutions": 3, "surroundings": {"tacho": {"pulses_per_revolution": 60}}}, "less than 12 samples"),
    ],
)
def test_what_does_not_fit_is_refused(rig, options, message):
    from sigdb.transmission import Damage

    options = dict(options)
    damage = Damage(gear=options.pop("damage"), tooth=1, stiffness_loss=0.1) if "damage" in options else None
    surroundings = Surroundings(**options.pop("surroundings", {}))
    with pytest.raises(InputError, match=message):
        synthetic_recording(rig, damage, sampling_rate=RATE, surroundings=surroundings, steps_per_tooth=16, **options)
