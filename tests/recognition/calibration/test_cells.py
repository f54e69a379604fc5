"""Coverage of sets and intervals in the least favourable cell, and probabilities for unseen tooth counts, simulated."""

import math

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import logsumexp

from sigdb.database import QUANTITIES
from sigdb.recognition import LocationClassifier, LocationSets, SeverityIntervals, SeverityRegressor
from sigdb.recognition.calibration.cells import band_edges, levels_of
from sigdb.recognition.calibration.conformal import greatest_quantile, least_specimens, specimen_quantile
from sigdb.recognition.rows.batch import Batch

SIZES = np.array([1.5, 3.0, 6.0])
"""Severities: how far the damaged tooth stands out, in units of the lesser noise."""

NOISE = np.array([1.0, 2.0])


class Located(LocationClassifier):
    """The classifier with scores from elsewhere: the column ``scores``."""

    def fit_scorer(self, X, y):
        return self

    def tooth_scores(self, X):
        return np.stack(X.table["scores"].to_list())


class Judged(SeverityRegressor):
    """The regressor with estimates from elsewhere: columns ``estimate_0`` and so on."""

    def _learn(self, X, y):
        return self

    def _estimates(self, X):
        return X.table[[f"estimate_{i}" for i in range(3)]].to_numpy()


def frame(count, specimens, teeth, noise):
    return pd.DataFrame(
        {"teeth": teeth, "speed_rpm": 1.0, "torque": 1.0, "wigner_ville": 0.0, "averages": 4}
        | {"specimen": np.arange(count) % specimens, "scatter": 2.0 * noise}
    )


def located(stream, *, specimens, rows, teeth=6, healthy=0.25, hidden=1 / 3):
    """Teeth of which the damaged one is greater by its severity, under noise, and a level of the specimen's own.

    Scores are the logarithms of likelihood ratios under the law without specimens.
    """
    count = specimens * rows
    noise, size = stream.choice(NOISE, count), stream.choice(SIZES, count, p=[hidden, 1 / 3, 2 / 3 - hidden])
    tooth = np.where(stream.random(count) < healthy, 0, stream.integers(1, teeth + 1, count))
    X = frame(count, specimens, teeth, noise)
    x = noise[:, None] * stream.standard_normal((count, teeth))
    shrunk = size * np.exp(0.2 * stream.standard_normal(specimens))[X["specimen"]]
    x[np.arange(count), tooth - 1] += np.where(tooth > 0, shrunk, 0.0)
    weight = np.log([hidden, 1 / 3, 2 / 3 - hidden])
    each = (x[:, :, None] * SIZES - SIZES**2 / 2) / noise[:, None, None] ** 2 + weight
    y = pd.DataFrame({"tooth": tooth, "size": np.where(tooth > 0, size, 0.0)})
    return X.assign(scores=list(logsumexp(each, axis=2))), y


@pytest.fixture(scope="module")
def held():
    """Of test rows of 10 trainings on 30 specimens: noise, severity, whether sets hold the truth, and did before."""
    stream, found = np.random.default_rng(1), []
    for _ in range(10):
        X, y = located(stream, specimens=30, rows=60, hidden=0.15)
        one = Located().fit(X, y, X["specimen"].to_numpy())
        asked, true = located(stream, specimens=100, rows=20, hidden=0.15)
        tooth = true["tooth"].to_numpy()
        log_p = [np.log(one.predict_proba(some)) for some in (X, asked)]
        strange = [-p[np.arange(len(p)), t] for p, t in zip(log_p, (y["tooth"], tooth), strict=True)]
        damaged = (y["tooth"] > 0).to_numpy()
        pooled = specimen_quantile(strange[0][damaged], X["specimen"].to_numpy()[damaged], 0.9)
        sets = one.predict_set(asked)
        found.append(
            pd.DataFrame(
                {
                    "noise": asked["scatter"] / 2,
                    "size": true["size"],
                    "inside": sets[np.arange(len(tooth)), tooth],
                    "pooled": strange[1] <= pooled,
                    "count": sets.sum(axis=1),
                }
            )
        )
    return pd.concat(found)


def test_sets_hold_the_truth_of_every_severity_and_noise_and_a_pooled_threshold_would_not(held):
    """The error is that of 10 trainings with 100 test specimens each, as if each counted for one."""
    cells = held.groupby(["noise", "size"])
    error = math.sqrt(0.09 / (10 * 100))
    assert len(cells) == 2 * 4
    assert cells["inside"].mean().min() > 0.9 - 4 * error
    damaged = held[held["size"] > 0]
    assert damaged["pooled"].mean() > 0.9 - 4 * error
    assert damaged.groupby(["noise", "size"])["pooled"].mean().min() < 0.75


def test_sets_are_small_where_damage_is_plain(held):
    sizes = held.groupby(["noise", "size"])["count"].mean()
    assert sizes[1.0, 6.0] < 1.1
    assert 2 < sizes[2.0, 1.5] < 7


def test_a_record_of_unknown_noise_has_the_set_of_the_worst(held):
    stream = np.random.default_rng(2)
    X, y = located(stream, specimens=20, rows=60)
    one = Located().fit(X, y, X["specimen"].to_numpy())
    assert one.set_thresholds_.shape == (len(one.set_edges_) + 1, 2)
    assert len(one.set_edges_) > 0
    unknown = one.predict_set(X.drop(columns="scatter"))
    scores = one.decision_function(X.drop(columns="scatter"))
    limit = one.set_thresholds_.max(axis=0)[np.minimum(np.arange(7), 1)]
    expected = logsumexp(scores, axis=1, keepdims=True) - scores <= limit
    expected[np.arange(len(X)), scores.argmax(axis=1)] = True
    assert_array_equal(unknown, expected)


def test_fewer_than_nine_specimens_support_no_smaller_set():
    X, y = located(np.random.default_rng(3), specimens=8, rows=60)
    assert Located().fit(X, y, X["specimen"].to_numpy()).predict_set(X).all()


def test_probabilities_hold_for_a_tooth_count_that_training_has_not_seen():
    """Scores are likelihood ratios, so that the prior of a tooth, 1 / Z, is all that changes from 6 teeth to 48."""
    stream = np.random.default_rng(4)
    few, y = located(stream, specimens=100, rows=80, teeth=6)
    many, true = located(stream, specimens=100, rows=80, teeth=48)
    one = Located().fit(few, y, few["specimen"].to_numpy())
    none = one.predict_proba(many)[:, 0]
    healthy = (true["tooth"] == 0).to_numpy()
    assert none.mean() == pytest.approx(healthy.mean(), abs=4 * math.sqrt(0.25 * 0.75 / len(many)))
    # Without log Z of the count that is asked about 'none' would be said of too few.
    odds = np.log(none / (1 - none)) - math.log(48 / 6)
    assert (1 / (1 + np.exp(-odds))).mean() < healthy.mean() - 0.05


def test_intervals_hold_every_severity_and_noise_and_pooled_ones_would_not():
    """Errors grow with the noise and, of the first severity, with the second one."""
    stream, found = np.random.default_rng(5), []
    for _ in range(15):
        (X, y), (asked, true) = (judged(stream, specimens) for specimens in (30, 100))
        one = Judged().fit(X, y, X["specimen"].to_numpy())
        said = one.predict(asked)
        name = QUANTITIES[0]
        within = (said[f"{name}_low"] <= true[name]) & (true[name] <= said[f"{name}_high"])
        q = specimen_quantile(np.abs(X["estimate_0"] - y[name]), X["specimen"], 0.9)
        found.append(
            true.assign(noise=asked["scatter"], within=within, pooled=(asked["estimate_0"] - true[name]).abs() <= q)
        )
    cells = pd.concat(found).groupby(["noise", *QUANTITIES[:2]])[["within", "pooled"]].mean()
    assert len(cells) == 2 * 3 * 2
    assert cells["within"].min() > 0.9 - 4 * math.sqrt(0.09 / 1500)
    assert cells["pooled"].min() < 0.8


def judged(stream, specimens, rows=60):
    count = specimens * rows
    noise, first, second = (
        stream.choice(NOISE, count),
        stream.choice([0.0, 5.0, 10.0], count),
        stream.choice([0.0, 1.0], count),
    )
    X = frame(count, specimens, 6, noise)
    own = np.exp(0.3 * stream.standard_normal(specimens))[X["specimen"]]
    error = 0.5 * noise * (1 + second) * own * stream.standard_normal(count)
    y = pd.DataFrame(dict(zip(("tooth", *QUANTITIES), (1, first, second, 1.0), strict=True)), index=X.index)
    return X.assign(estimate_0=first + error, estimate_1=second, estimate_2=1.0), y


# The parts


def test_the_greatest_quantile_is_that_of_the_worst_cell():
    stream = np.random.default_rng(6)
    scores, cells, specimens = stream.normal(size=600), stream.integers(0, 3, 600), np.arange(600) % 20
    each = [specimen_quantile(scores[cells == k] + k, specimens[cells == k], 0.9) for k in range(3)]
    assert greatest_quantile(scores + cells, cells, specimens, 0.9) == max(each) == each[2]


def test_cells_of_few_specimens_count_together_or_with_all():
    scores, specimens = np.arange(40.0), np.arange(40) % 20
    cells = np.where(specimens < 4, 1, np.where(specimens < 10, 2, 0))
    few = cells > 0
    expected = [specimen_quantile(scores[some], specimens[some], 0.9) for some in (~few, few)]
    # Ten specimens in the first cell, four and six in the others: these are ten together.
    assert greatest_quantile(scores, cells, specimens, 0.9) == max(expected)
    assert greatest_quantile(-scores, cells, specimens, 0.9) == specimen_quantile(-scores[few], specimens[few], 0.9)
    # Sixteen specimens, and four that are too few also together.
    alone = specimens < 4
    both = [specimen_quantile(-scores[some], specimens[some], 0.9) for some in (~alone, scores >= 0)]
    assert greatest_quantile(-scores, alone.astype(int), specimens, 0.9) == max(both)
    assert greatest_quantile(scores[:8], np.zeros(8, int), specimens[:8], 0.9) == math.inf


@pytest.mark.parametrize(("level", "least"), [(0.9, 9), (0.5, 1), (0.99, 99), (0.8, 4)])
def test_the_least_number_of_specimens(level, least):
    assert least_specimens(level) == least
    for count in (least - 1, least):
        assert math.isfinite(specimen_quantile(np.zeros(count), np.arange(count), level)) == (count == least)


def test_the_noise_of_a_record_is_found_in_its_revolutions():
    """64 revolutions of 500 samples with noise of 0.3: the average's variance is 0.3^2 / 64."""
    revolutions = np.sin(np.arange(500)) + 0.3 * np.random.default_rng(7).standard_normal((64, 500))
    scatter = math.sqrt(revolutions.var(axis=0, ddof=1).mean())
    (found,) = Batch(table=pd.DataFrame({"scatter": [scatter], "averages": [64]})).noise_db(0.5)
    error = 10 / math.log(10) * math.sqrt(2 / (500 * 63))
    assert found == pytest.approx(10 * math.log10(0.3**2 / 64 / 0.5), abs=4 * error)


@pytest.mark.parametrize("rows", [{"scatter": [1.0]}, {"averages": [2]}, {"averages": [2], "scatter": [0.0]}])
def test_noise_may_be_unknown(rows):
    noise = Batch(table=pd.DataFrame(rows)).noise_db()
    assert np.isnan(noise).tolist() == [True]
    assert band_edges(noise, np.arange(1), 0.9).size == 0


def test_bands_have_specimens_enough():
    noise, specimens = np.repeat([0.0, 4.0, 8.0, 20.0], [30, 8, 30, 30]), np.arange(98) % 30
    edges = band_edges(noise, specimens, 0.9)
    band = np.searchsorted(edges, noise, side="right")
    assert [len(np.unique(specimens[band == one])) >= 9 for one in range(len(edges) + 1)] == [True] * 3
    assert band_edges(np.zeros(50), np.arange(50), 0.9).size == 0


def test_levels_are_few_and_nan_is_one_of_its_own():
    levels, nearest = levels_of(np.array([0.2, 0.0, np.nan, 0.2]))
    assert_array_equal(levels, [0.0, 0.2])
    assert_array_equal(nearest, [1, 0, 2, 1])
    values = np.random.default_rng(8).random(1000)
    levels, nearest = levels_of(values)
    assert len(levels) == 12
    assert_allclose(np.abs(values - levels[nearest]), np.abs(values[:, None] - levels).min(axis=1))


class AnySets(LocationSets):
    def __init__(self, coverage_by):
        self.coverage, self.coverage_by = 0.9, coverage_by


class AnyIntervals(SeverityIntervals):
    def __init__(self, coverage_by):
        self.coverage, self.coverage_by = 0.9, coverage_by


def test_coverage_over_all_rows_has_one_threshold_and_smaller_sets():
    """Half of the rows are ten times stranger: by cell these are covered too, over all rows 0.9 of all are."""
    stream, rows = np.random.default_rng(4), 4000
    severity = np.repeat([[0.2], [0.4]], rows // 2, axis=0)
    strange = stream.exponential(size=rows) * np.where(severity[:, 0] == 0.2, 10.0, 1.0)
    tooth, groups = np.ones(rows, int), np.arange(rows) % 40
    cells = {"point": np.zeros(rows, int), "noise": np.zeros(rows), "groups": groups}
    sets, intervals = {}, {}
    for by in ("cell", "all"):
        sets[by], intervals[by] = AnySets(by), AnyIntervals(by)
        sets[by]._fit_sets(strange, tooth, severity, **cells)
        intervals[by]._fit_intervals(strange[:, None], severity, **cells)
    of_new_specimen = 10 * -np.log(1 - 0.9 * 41 / 40)
    assert sets["cell"].set_thresholds_[0, 1] == pytest.approx(of_new_specimen, rel=0.05)
    (threshold,) = np.unique(sets["all"].set_thresholds_)
    assert 0.9 <= (strange <= threshold).mean() < 0.95
    assert threshold < 0.8 * sets["cell"].set_thresholds_[0, 1]
    assert np.unique(intervals["all"].thresholds_[0]).tolist() == [threshold]
    assert intervals["cell"].thresholds_[0][0, 0] > 5 * intervals["cell"].thresholds_[0][0, 1]
