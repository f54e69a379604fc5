"""Surprise: as rare as it says for white residuals, and at the orders or in the band that were changed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import chi2, norm

from sigdb.measurement import order_bands
from sigdb.recognition.noise.surprise import ANOTHER_TOOTH, MORE_DAMAGE, normal_surprise, surprise, surprise_text

TEETH, N = 8, 256
ANGLE = 2 * np.pi * np.arange(N) / N
EVEN = np.ones((1, order_bands(N, TEETH).max() + 1))


def white(rows, seed=0):
    return np.random.default_rng(seed).standard_normal((rows, N))


@pytest.mark.parametrize("level", [1.0, 2.0])
def test_white_residuals_are_as_rarely_surprising_as_it_says(level):
    """There are two families of tests, each with a sum of probabilities of 10^-level."""
    values, _ = surprise(white(20000), TEETH, np.broadcast_to(EVEN, (20000, EVEN.shape[1])))
    share, nominal = (values > level).mean(), 2 * 10**-level
    assert 0.8 * nominal < share < 1.1 * nominal


def test_a_ghost_order_is_named():
    values, places = surprise(white(50) + 0.8 * np.cos(27 * ANGLE), TEETH, np.broadcast_to(EVEN, (50, EVEN.shape[1])))
    assert (values > 4).all()
    assert {surprise_text(place, N, TEETH) for place in places} == {"its residual stands out at order 27"}


def test_a_band_of_more_noise_is_named_unless_it_is_known():
    spectrum = np.fft.rfft(white(50), axis=1)
    spectrum[:, 16:32] *= 3
    e = np.fft.irfft(spectrum, N, axis=1)
    values, places = surprise(e, TEETH, np.broadcast_to(EVEN, (50, EVEN.shape[1])))
    assert (values > 5).all()
    text = "its residual stands out in orders 16 to 31"
    assert np.mean([surprise_text(place, N, TEETH) == text for place in places]) > 0.9
    known = EVEN + 8.0 * (np.arange(EVEN.shape[1]) == 3)
    assert (surprise(e, TEETH, np.broadcast_to(known, (50, known.shape[1])))[0] < 3.5).all()


@pytest.mark.parametrize("size", [1.0, 30.0])
def test_it_is_the_least_probability_written_out(size):
    """Energies of 30 deviations have probabilities below the least number; single precision errs by 1e-5."""
    e = size * white(20, seed=3)
    energy, band = 2 * np.abs(np.fft.rfft(e, axis=1)[:, 1:-1]) ** 2 / N, order_bands(N, TEETH)[1:-1]
    of_bands = [chi2.logsf(energy[:, band == b].sum(axis=1), 2 * (band == b).sum()) for b in np.unique(band)]
    of_orders = chi2.logsf(energy, 2).min(axis=1) + np.log(energy.shape[1])
    expected = -np.minimum(np.min(of_bands, axis=0) + np.log(len(of_bands)), of_orders) / np.log(10)
    even = np.broadcast_to(EVEN, (20, EVEN.shape[1]))
    assert_allclose(surprise(e, TEETH, even)[0], expected, rtol=1e-9)
    assert_allclose(surprise(e.astype(np.float32), TEETH, even)[0], expected, rtol=1e-5)


def test_tests_against_one_change_are_normal():
    assert_allclose(normal_surprise(norm.isf(np.array([1e-3, 1e-6])), 10), [2.0, 5.0])
    assert surprise_text(ANOTHER_TOOTH, N, TEETH) == "its residual shows damage at another tooth"
    assert surprise_text(MORE_DAMAGE, N, TEETH) == "its residual shows more damage than templates have"
