"""Conformal quantiles: against their definition, and the coverage that they promise, on rows and on specimens."""

import math

import numpy as np
import pytest

from sigdb.recognition.calibration.conformal import row_quantile, specimen_quantile


@pytest.mark.parametrize(
    ("m", "level", "k"), [(9, 0.9, 9), (99, 0.9, 90), (19, 0.9, 18), (4, 0.5, 3), (999, 0.999, 999)]
)
def test_the_quantile_of_rows_is_the_kth_smallest(m, level, k):
    scores = np.random.default_rng(m).permutation(np.arange(1.0, m + 1))
    assert row_quantile(scores, level) == k


@pytest.mark.parametrize(("m", "level"), [(8, 0.9), (998, 0.999), (0, 0.5)])
def test_too_few_rows_support_no_level(m, level):
    assert row_quantile(np.zeros(m), level) == math.inf


def test_a_further_row_is_covered_as_promised():
    """The k-th smallest of m continuous scores covers exactly k / (m + 1); the bound is four standard errors."""
    scores = np.random.default_rng(1).exponential(size=(20_000, 25))
    covered = np.mean([row[0] <= row_quantile(row[1:], 0.9) for row in scores])
    expected = 23 / 25
    assert abs(covered - expected) < 4 * math.sqrt(expected * (1 - expected) / len(scores))


def test_specimens_with_one_row_each_are_rows():
    scores = np.random.default_rng(2).normal(size=30)
    for level in (0.5, 0.9, 30 / 31):
        assert specimen_quantile(scores, np.arange(30), level) == row_quantile(scores, level)


def test_specimens_count_alike_however_many_rows_they_have():
    scores = np.concatenate([np.zeros(1000), [1.0], [2.0]])
    specimens = np.concatenate([np.zeros(1000), [1], [2]])
    assert specimen_quantile(scores, specimens, 0.25) == 0.0
    assert specimen_quantile(scores, specimens, 0.5) == 1.0
    assert specimen_quantile(scores, specimens, 0.75) == 2.0
    assert specimen_quantile(scores, specimens, 0.76) == math.inf


@pytest.mark.parametrize(("count", "finite"), [(9, True), (8, False)])
def test_nine_specimens_support_nine_tenths(count, finite):
    specimens = np.repeat(np.arange(count), 50)
    assert math.isfinite(specimen_quantile(np.arange(len(specimens)), specimens, 0.9)) == finite


def test_a_row_of_a_further_specimen_is_covered_where_rows_resemble_each_other():
    """Scores are a specimen's own level plus a row's; rows taken as exchangeable would cover too few."""
    stream, trials, specimens, rows = np.random.default_rng(3), 3000, 12, 20
    hit, naive = 0, 0
    for _ in range(trials):
        scores = np.abs(stream.normal(size=(specimens + 1, 1)) + 0.3 * stream.normal(size=(specimens + 1, rows)))
        known, index = scores[:-1].ravel(), np.repeat(np.arange(specimens), rows)
        hit += scores[-1, 0] <= specimen_quantile(known, index, 0.9)
        naive += scores[-1, 0] <= row_quantile(known, 0.9)
    error = 4 * math.sqrt(0.09 / trials)
    assert hit / trials > 0.9 - error
    assert naive / trials < 0.9 - error
