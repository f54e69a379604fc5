"""Unit: intervals over specimens, against resamples drawn row by row, the law of a mean, and counted coverage."""

import numpy as np
import pytest

from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens, errors_to_end


def resampled(specimens, k):
    """Positions of the rows of a resample, each specimen's as often as it was drawn."""
    weights = specimens.weights[k].astype(int)
    return np.concatenate([np.tile(np.flatnonzero(specimens.index == i), n) for i, n in enumerate(weights)])


@pytest.fixture
def sample():
    stream = np.random.default_rng(5)
    names = stream.permutation(np.arange(200) % 40) + 3
    values = stream.normal(size=200) + 0.1 * names
    values[stream.random(200) < 0.2] = np.nan
    return Specimens(names, seed=2), values


def test_the_first_row_of_weights_is_the_specimens_as_they_are(sample):
    specimens, _ = sample
    assert specimens.count == 40
    assert (specimens.weights[0] == 1).all()
    np.testing.assert_array_equal(specimens.weights.sum(axis=1), 40)
    # Each specimen is drawn once on average, with the variance 1 - 1/40 of a multinomial.
    drawn = specimens.weights[1:]
    np.testing.assert_allclose(drawn.mean(axis=0), 1, atol=4 * np.sqrt(39 / 40 / len(drawn)))


def test_mean_and_root_mean_square_are_those_of_resampled_rows(sample):
    specimens, values = sample
    rows = [resampled(specimens, k) for k in range(len(specimens.weights))]
    for figure, statistic in (
        (specimens.mean(values), lambda at: np.nanmean(values[at])),
        (specimens.root_mean_square(values), lambda at: np.sqrt(np.nanmean(values[at] ** 2))),
    ):
        expected = np.array([statistic(at) for at in rows])
        assert figure.value == pytest.approx(expected[0], rel=1e-12)
        np.testing.assert_allclose((figure.low, figure.high), np.quantile(expected[1:], [0.025, 0.975]), rtol=1e-12)


def test_totals_of_tables_are_sums_over_resampled_rows(sample):
    specimens, _ = sample
    values = np.random.default_rng(1).normal(size=(200, 2, 3))
    totals = specimens.totals(values)
    for k in (0, 1, 500):
        np.testing.assert_allclose(totals[k], values[resampled(specimens, k)].sum(axis=0), rtol=1e-9, atol=1e-12)


def test_selected_rows_have_the_resamples_of_their_specimens(sample):
    """As drawn for these rows alone; and the same resamples, not drawn again, where all specimens stay."""
    specimens, values = sample
    for inside in (values > 1, specimens.index > 2):
        fresh, selected = Specimens(specimens.index[inside], seed=2), specimens.select(inside)
        np.testing.assert_array_equal(selected.weights, fresh.weights)
        np.testing.assert_array_equal(selected.index, fresh.index)
    assert specimens.select(np.arange(200) > 0).weights is specimens.weights


def test_what_is_not_known_has_no_interval():
    specimens = Specimens(np.arange(40))
    assert specimens.interval(np.array([np.nan, 1.0, 2.0])) is UNKNOWN
    assert str(UNKNOWN) == "-"
    assert str(Estimate(value=0.5, low=np.nan, high=np.nan)) == "0.500"
    # Resamples without a value do not count.
    assert specimens.interval(np.array([1.0, np.nan, 1.0, 3.0])) == Estimate(value=1.0, low=1.05, high=2.95)


@pytest.mark.parametrize("count", [3, 4, 6, 12])
def test_intervals_of_few_specimens_hold_the_truth_as_often_as_stated(count):
    """Coverage over 600 drawn samples with a scatter between specimens: .95 less three binomial standard errors."""
    stream = np.random.default_rng(count)
    specimens = Specimens(np.repeat(np.arange(count), 5))
    held = 0
    for _ in range(600):
        values = np.repeat(stream.normal(size=count), 5) + stream.normal(size=5 * count)
        estimate = specimens.mean(values)
        held += estimate.low <= 0 <= estimate.high
    assert abs(held / 600 - 0.95) < 3 * np.sqrt(0.95 * 0.05 / 600)


def test_few_specimens_of_one_row_have_the_interval_of_a_mean_by_student():
    values = np.array([0.1, 0.4, 0.35, 0.8, 0.2])
    mean, error = values.mean(), values.std(ddof=1) / np.sqrt(5)
    estimate = Specimens(np.arange(5)).mean(values)
    expected = np.array([mean - 2.776445 * error, mean + 2.776445 * error])  # t of 4 degrees of freedom, by table
    np.testing.assert_allclose([estimate.low, estimate.high], expected, atol=0.05 * 2.776445 * error)
    assert errors_to_end(5) == pytest.approx(2.776445 * np.sqrt(5 / 4))


def test_a_share_without_a_miss_has_the_interval_of_independent_rows():
    """Wilson's interval of 40 of 40 is from 40 / (40 + 1.96^2) to 1."""
    estimate = Specimens(np.repeat(np.arange(4), 10)).mean(np.ones(40))
    assert estimate.low == pytest.approx(40 / (40 + 1.959964**2), rel=1e-6)
    assert (estimate.value, estimate.high) == (1, 1)


def test_shares_of_few_specimens_stay_within_0_and_1():
    estimate = Specimens([0, 0, 1, 1, 2, 2]).mean(np.array([1.0, 1, 1, 1, 1, 0]))
    assert 0 <= estimate.low < estimate.value < estimate.high == 1
