"""Verification: the regression of signals on sizes, against least squares, its law, and a likelihood written out."""

import numpy as np
import pytest
from scipy.stats import norm

from sigdb.core.errors import InputError
from sigdb.recognition import signal_response

INTERCEPT, SLOPE, DEVIATION = 3.0, 1.2, 0.25
SIZE = np.exp(np.linspace(np.log(0.02), np.log(0.4), 60))


def signals(size=SIZE, seed=2):
    return np.exp(INTERCEPT + SLOPE * np.log(size) + DEVIATION * np.random.default_rng(seed).standard_normal(len(size)))


def written_out(size, signal, least, intercept, slope, deviation):
    z = (np.log(np.maximum(signal, least)) - intercept - slope * np.log(size)) / deviation
    return np.where(signal <= least, norm.logcdf(z), norm.logpdf(z) - np.log(deviation)).sum()


def test_without_censored_signals_it_is_least_squares():
    found = signal_response(SIZE, signals(), threshold=1.0)
    slope, intercept = np.polyfit(np.log(SIZE), np.log(signals()), 1)
    rest = np.log(signals()) - intercept - slope * np.log(SIZE)
    np.testing.assert_allclose([found.slope, found.intercept], [slope, intercept], rtol=1e-5)
    assert found.deviation == pytest.approx(np.sqrt(np.mean(rest**2)), rel=1e-5)
    a90 = np.exp((norm.ppf(0.9) * found.deviation - intercept) / slope)
    assert found.severity() == pytest.approx(a90, rel=1e-5)
    assert found.probability(found.severity(0.7)) == pytest.approx(0.7)


def test_censored_signals_hardly_move_the_line_and_cut_off_ones_do():
    """A third of the signals lies below the least one. The law that made them is found again from 4000 sizes."""
    size = np.tile(SIZE, 67)
    signal = signals(size)
    least = np.quantile(signal, 1 / 3)
    found = signal_response(size, signal, threshold=2.0, least=least)
    np.testing.assert_allclose([found.intercept, found.slope, found.deviation], [3.0, 1.2, 0.25], rtol=0.03)
    inside = signal > least
    cut = np.polyfit(np.log(size[inside]), np.log(signal[inside]), 1)[0]
    assert abs(cut - SLOPE) > 3 * abs(found.slope - SLOPE)


def test_it_is_most_likely_and_its_bound_is_where_the_likelihood_ratio_says():
    signal, least = signals(), np.quantile(signals(), 0.2)
    found = signal_response(SIZE, signal, threshold=1.0, least=least)
    best = written_out(SIZE, signal, least, found.intercept, found.slope, found.deviation)
    for change in np.vstack([np.eye(3), -np.eye(3)]) * 0.01:
        moved = np.array([found.intercept, found.slope, found.deviation]) + change
        assert written_out(SIZE, signal, least, *moved) < best
    bound = found.severity_bound()
    slopes, deviations = np.linspace(0.8, 1.6, 161), np.linspace(0.15, 0.45, 121)
    at_bound = max(
        written_out(SIZE, signal, least, norm.ppf(0.9) * deviation - slope * np.log(bound), slope, deviation)
        for slope in slopes[::4]
        for deviation in deviations[::4]
    )
    assert 2 * (best - at_bound) == pytest.approx(norm.ppf(0.95) ** 2, abs=0.1)
    assert found.severity() < bound < 1.2 * found.severity()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"signal": np.ones(3)}, r"size has the shape \(60,\), and signal \(3,\)"),
        ({"size": SIZE - 0.02}, "sizes must be above 0"),
        ({"threshold": 0.0}, "threshold = 0 must be above 0"),
        ({"least": 1e9}, "0 signals are inside the limits; 5"),
        ({"signal": 1 / SIZE}, "the signals do not grow with size"),
    ],
)
def test_data_that_show_nothing_are_refused(arguments, said):
    with pytest.raises(InputError, match=said):
        signal_response(**{"size": SIZE, "signal": signals(), "threshold": 1.0} | arguments)
