"""Verification: the limit holds the stated number of false alarms; steps are dated, and a trend is that of a line."""

import numpy as np
import pytest
from scipy.stats import norm

from sigdb.monitoring.alarms import alarm_limit, change_point, standardised, trend


@pytest.mark.parametrize(("rate", "looks", "healthy"), [(1.0, 52.0, 8), (2.0, 365.0, 20), (12.0, 365.0, 5)])
def test_the_limit_gives_the_stated_number_of_false_alarms(rate, looks, healthy):
    """Gaussian looks, with the mean and deviation of so many healthy ones: within five deviations of the count."""
    limit = alarm_limit(false_alarms_a_year=rate, looks_a_year=looks, healthy=healthy)
    trials = 400_000
    values = np.random.default_rng(0).standard_normal((trials, healthy + 1))
    some = values[:, :healthy]
    z = (values[:, -1] - some.mean(axis=1)) / some.std(axis=1, ddof=1)
    p = rate / (3 * looks)
    assert abs(np.sum(z > limit) - trials * p) < 5 * np.sqrt(trials * p)


def test_many_healthy_looks_give_the_quantile_of_the_normal_law():
    limit = alarm_limit(false_alarms_a_year=1.0, looks_a_year=500.0, healthy=100_000)
    assert limit == pytest.approx(norm.isf(1 / 1500), abs=1e-3)


def test_healthy_looks_that_scatter_less_than_noise_have_the_deviation_of_noise():
    healthy = np.array([True, True, True, False])
    values = standardised(np.array([1.0, 1.0, 1.0, 1.3]), healthy, least=0.1)
    np.testing.assert_allclose(values, [0, 0, 0, 3], atol=1e-12)


@pytest.mark.parametrize("step", [10, 25, 39])
def test_a_step_is_dated_within_its_interval(step):
    values = np.random.default_rng(step).standard_normal(40)
    values[step:] += 6.0
    found = change_point(values)
    assert found.low <= step <= found.high
    assert found.high - found.low <= 2


def test_noise_has_no_step():
    assert not any(change_point(np.random.default_rng(seed).standard_normal(60)) for seed in range(200))
    assert change_point(np.zeros(1)) is None


def test_a_trend_is_that_of_a_line():
    days = np.array([0.0, 1.0, 5.0, 9.0])
    found = trend(days, 0.3 * days + 1)
    assert (found.slope, found.per) == (pytest.approx(0.3), "day")
    assert (found.low, found.high) == (pytest.approx(0.3), pytest.approx(0.3))
    assert trend(None, np.arange(5.0)).per == "look"
    assert trend(np.zeros(5), np.arange(5.0)) is None
