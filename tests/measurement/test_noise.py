"""Unit: the random law of noise and of the scatter between revolutions. Bounds are five standard errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.measurement import MeasurementSettings, noise_deviation, revolution_scatter

SIGMAS = 5


@given(reference=st.floats(1e-12, 1e12), snr_db=st.floats(-60, 120))
def test_the_ratio_of_variances_in_decibel_is_the_snr(reference, snr_db):
    deviation = noise_deviation(np.array(reference), np.array(snr_db))
    assert_allclose(10 * np.log10(reference / deviation**2), snr_db, rtol=0, atol=1e-9)


def test_it_broadcasts_over_sensors_and_rows():
    reference, snr_db = np.array([1.0, 4.0]), np.array([[0.0], [20.0], [-20.0]])
    assert_allclose(noise_deviation(reference, snr_db), [[1, 2], [0.1, 0.2], [10, 20]], rtol=1e-15)


@pytest.mark.parametrize(("averages", "snr_db"), [(3, 0.0), (102, -10.0), (36, 20.0)])
def test_the_scatter_follows_the_law_of_measured_deviations(averages, snr_db):
    """Its square is the pooled variance: mean deviation^2, variance 2 deviation^4 / freedom; so is that of a record."""
    samples, draws = 64, 4000
    deviation = float(noise_deviation(np.array(2.5), np.array(snr_db)))
    freedom = samples * (averages - 1)
    drawn = revolution_scatter(np.random.default_rng(1), np.full(draws, deviation), samples, averages) ** 2
    assert_allclose(drawn.mean(), deviation**2, rtol=SIGMAS * np.sqrt(2 / freedom / draws))
    assert_allclose(drawn.var(), 2 * deviation**4 / freedom, rtol=SIGMAS * np.sqrt(2 / draws) * 1.5)

    records = deviation * np.random.default_rng(2).standard_normal((200, averages, samples))
    measured = records.var(axis=1, ddof=1).mean(axis=-1)
    assert_allclose(measured.mean(), drawn.mean(), rtol=SIGMAS * np.sqrt(2 / freedom) * np.sqrt(1 / 200 + 1 / draws))
    # Of the ratio of two sample variances, of 200 and of 4000 draws.
    assert_allclose(measured.var(ddof=1), drawn.var(), rtol=SIGMAS * np.sqrt(2 / 200))


def test_one_revolution_has_no_scatter():
    assert np.isnan(revolution_scatter(np.random.default_rng(0), np.ones(3), 64, 1)).all()


def test_averages_of_different_revolutions_are_drawn_together():
    """Each keeps its own law, in the order of the deviations; a single revolution among them has no scatter."""
    averages = np.array([[3], [1], [102]])
    drawn = revolution_scatter(np.random.default_rng(4), np.full((3, 2000), 2.0), 64, averages)
    assert np.isnan(drawn[1]).all()
    for row in (0, 2):
        freedom = 64 * (averages[row, 0] - 1)
        assert_allclose((drawn[row] ** 2).mean(), 4.0, rtol=SIGMAS * np.sqrt(2 / freedom / 2000))
        assert_allclose((drawn[row] ** 2).var(), 2 * 16.0 / freedom, rtol=SIGMAS * np.sqrt(2 / 2000) * 1.5)


def test_the_scatter_is_proportional_to_the_deviation_and_shaped_like_it():
    one, two = (revolution_scatter(np.random.default_rng(0), np.full((2, 3), d), 64, 3) for d in (1.0, 2.0))
    assert one.shape == (2, 3)
    assert_allclose(two, 2 * one, rtol=1e-15)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"averages": 0}, r"averages = 0 must be greater than or equal to 1"),
        ({"index_error": -1e-6}, r"index_error = -1e-06 must be greater than or equal to 0"),
        ({"snr_db": float("nan")}, r"snr_db = nan must be a finite number"),
        ({"averages": 3.5}, r"averages = 3.5 must be a valid integer"),
        ({"snr": 3.0}, r"unknown key snr; did you mean 'snr_db'\?"),
    ],
)
def test_settings_refuse(values, says):
    with pytest.raises(InputError, match=says):
        MeasurementSettings(**values)
