"""Verification: the noise of an average, order by order, against the density of the noise that was put in."""

import numpy as np
import pytest

from sigdb.recording import Channel, Recording, recorded_signature
from sigdb.recording.lines import average_noise

N, REVOLUTIONS = 768, 300
ORDERS = np.arange(N // 2 + 1)


def noise(corner, revolutions=REVOLUTIONS):
    """First-order noise x_i = a x_(i-1) + w_i and the density that its formula states, as a standard deviation."""
    a = np.exp(-2 * np.pi * corner / N)
    w = np.random.default_rng(3).standard_normal(revolutions * N + 1000)
    x = np.empty_like(w)
    last = 0.0
    for i, one in enumerate(w):
        last = x[i] = a * last + one
    return x[1000:], 1 / np.abs(1 - a * np.exp(-2j * np.pi * ORDERS / N))


@pytest.mark.parametrize("corner", [np.inf, 40.0])
def test_it_is_the_density_of_the_noise_whatever_its_colour(corner):
    x, density = noise(corner)
    found = average_noise(x, samples_per_rev=N, scatter=float(x.std()), highest=N / 2)
    ratio = found[1:-1] / (density[1:-1] / np.sqrt(REVOLUTIONS))
    # Medians of 300 bins of a power with an exponential law: 1 / (sqrt(300) ln 2) each, half that in amplitude.
    assert abs(ratio.mean() - 1) < 0.01
    assert ratio.std() < 0.06


def test_it_is_the_spread_of_averages():
    """Averages of one record's thirds differ by what is stated of each."""
    x, _ = noise(40.0)
    thirds = x.reshape(3, REVOLUTIONS // 3, N)
    spread = np.abs(np.fft.rfft(thirds.mean(axis=1), axis=1) / np.sqrt(N)) ** 2
    stated = average_noise(thirds[0].ravel(), samples_per_rev=N, scatter=1.0, highest=N / 2) ** 2
    # 3 x 383 complex numbers of unit power.
    assert np.mean(spread[:, 1:-1] / stated[1:-1]) == pytest.approx(1, abs=4 / np.sqrt(3 * 383))


def test_lines_do_not_count():
    """Tones of the shaft, of a mate of 36 teeth and of nothing named; scatter holds all but the first."""
    x, _ = noise(np.inf)
    theta = np.arange(len(x)) / N
    tones = sum(5 * np.cos(2 * np.pi * order * theta) for order in (12, 24, 13, 12 + 1 / 3, 12 - 1 / 3, 7.43))
    clean, with_lines = (
        average_noise(one, samples_per_rev=N, scatter=9.0, highest=N / 2)[1:-1] for one in (x, x + tones)
    )
    np.testing.assert_allclose(with_lines, clean, rtol=0.2)
    assert abs(np.mean(with_lines / clean) - 1) < 0.01


def test_of_few_revolutions_it_is_the_scatter_in_the_band_of_the_record():
    found = average_noise(np.zeros(16 * N), samples_per_rev=N, scatter=2.0, highest=N / 8)
    np.testing.assert_allclose(found, 2.0 / np.sqrt(16 / 4))


def test_a_signature_has_it_in_the_unit_of_its_average():
    """White noise of a record at 1/20 of a revolution: density s^2 in each of its own samples."""
    fs, rate, s = 10_000.0, 10.0, 0.4
    t = np.arange(200_000) / fs
    x = np.cos(2 * np.pi * 12 * rate * t) + s * np.random.default_rng(0).standard_normal(len(t))
    channels = (
        Channel(name="a1", samples=x, sampling_rate=fs, unit="m/s^2"),
        Channel(name="tacho", samples=5.0 * (rate * t % 1 < 0.1), sampling_rate=fs),
    )
    signature = recorded_signature(Recording(source="made here", channels=channels, tacho="tacho"), teeth=12)
    # As many samples a revolution, 768 and 1000, hold the same power of a density in another deviation.
    stated = s * np.sqrt(768 / 1000) / np.sqrt(signature.averages)
    assert np.mean(signature.noise[12:200]) == pytest.approx(stated, rel=0.02)


def test_revolutions_of_a_large_prime_number_lose_a_few_at_the_end():
    x = np.random.default_rng(5).normal(size=97 * 64)
    whole, cut = (
        average_noise(part, samples_per_rev=64, scatter=1.0, highest=32.0, averages=97) for part in (x, x[: 96 * 64])
    )
    np.testing.assert_array_equal(whole, cut)
    assert whole.mean() == pytest.approx(1 / np.sqrt(97), rel=0.03)
