"""Unit: intervals over specimens, against the same resamples drawn row by row and against the law of a mean."""

import numpy as np
import pytest

from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens, interval


def resampled(specimens, k):
    """Positions of the rows of a resample, each specimen's as often as it was drawn."""
    weights = specimens.weights[k].astype(int)
    return np.concatenate([np.tile(np.flatnonzero(specimens.index == i), n) for i, n in enumerate(weights)])


@pytest.fixture
def sample():
    stream = np.random.default_rng(5)
    names = stream.choice([3, 7, 20, 21, 50, 51, 52], 200)
    values = stream.normal(size=200) + 0.1 * names
    values[stream.random(200) < 0.2] = np.nan
    return Specimens(names, seed=2), values


def test_the_first_row_of_weights_is_the_specimens_as_they_are(sample):
    specimens, _ = sample
    assert specimens.count == 7
    assert (specimens.weights[0] == 1).all()
    np.testing.assert_array_equal(specimens.weights.sum(axis=1), 7)
    # Each specimen is drawn once on average, with the variance 1 - 1/7 of a multinomial.
    drawn = specimens.weights[1:]
    np.testing.assert_allclose(drawn.mean(axis=0), 1, atol=4 * np.sqrt(6 / 7 / len(drawn)))


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
    assert interval(np.array([np.nan, 1.0, 2.0])) is UNKNOWN
    assert str(UNKNOWN) == "-"
    assert str(Estimate(value=0.5, low=np.nan, high=np.nan)) == "0.500"
    # Resamples without a value do not count.
    assert interval(np.array([1.0, np.nan, 1.0, 3.0])) == Estimate(value=1.0, low=1.05, high=2.95)
