"""Template scores, and location, severity and detection from them: on a bank of invented laws, drawn from at will."""

import math

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import logsumexp
from scipy.stats import multivariate_normal
from sklearn.base import clone, is_classifier, is_regressor
from sklearn.frozen import FrozenEstimator

from sigdb.core.errors import InputError
from sigdb.database import QUANTITIES, Template
from sigdb.measurement import index_error_covariance
from sigdb.recognition import (
    Detector,
    RecognitionSettings,
    TemplateBank,
    TemplateLocation,
    TemplateScores,
    TemplateSeverity,
    train,
)
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.templates.bank import PointTemplates
from sigdb.recognition.templates.hypotheses import Hypotheses

TEETH, STEP, MATE = 4, 6, 10
N = TEETH * STEP
SEVERITY = np.array([[0.0, 0.0, 0], [0.2, 0.0, 1], [0.4, 0.0, 1], [0.2, 2.0, 2], [0.4, 2.0, 2]])
INDEX_ERROR, NOISE, AVERAGES = 2e-6, 1.1, 16


def stored_laws(seed=3):
    stream = np.random.default_rng(seed)
    mesh = np.cos(2 * np.pi * TEETH * np.arange(N) / N)
    bump, second = stream.standard_normal((2, N))
    # As of a healthy gear: the response to the error of a tooth is that of the first, turned.
    first = 1e5 * stream.standard_normal(N)
    response = np.stack([np.roll(first, j * STEP) for j in range(TEETH)], axis=1)
    return [
        Template(
            case={"template": i, "tooth": min(i, 1)} | dict(zip(QUANTITIES, row, strict=True)),
            signals=(mesh + 2 * row[0] * bump + 0.2 * row[1] * second).astype(np.float32).astype(float)[None],
            specimen_response=response[None],
            harmonic_response=np.zeros((1, N, 0, 2)),
            orders=np.zeros(0),
            reference_variance=np.ones(1),
        )
        for i, row in enumerate(SEVERITY)
    ]


def point(speed_rpm=1000.0, torque=10.0, seed=3):
    laws = Hypotheses.from_templates(stored_laws(seed), teeth=TEETH, mate_teeth=MATE)
    (one,) = PointTemplates.of(
        [laws], [np.array([1.0, 0.1, 0.2, 0.3, 0.4])], points=[(speed_rpm, torque)], index_error=INDEX_ERROR
    )
    return one


@pytest.fixture(scope="module")
def bank():
    return TemplateBank(sensor="casing", index_error=INDEX_ERROR, points=(point(),))


def frame(x, noise=NOISE, **columns):
    """Rows as a database has them: the noise of the average is its scatter over the root of its revolutions."""
    rows = {"teeth": TEETH, "speed_rpm": 1000.0, "torque": 10.0, "averages": AVERAGES}
    scatter = np.broadcast_to(noise, len(x)) * math.sqrt(AVERAGES)
    return pd.DataFrame({"tsa": list(x), "scatter": scatter, **rows, **columns})


def drawn(bank, stream, count, *, healthy=0.3):
    """Rows drawn from the law, each of its own specimen, with their labels."""
    place = np.where(
        stream.random(count) < healthy, 0, stream.choice(np.arange(1, 5), size=count, p=bank.points[0].share[1:])
    )
    tooth = np.where(place == 0, 0, stream.integers(1, TEETH + 1, count))
    x = bank.points[0].hypotheses.draw(stream, place, tooth, noise=NOISE, index_error=INDEX_ERROR)
    labels = pd.DataFrame(SEVERITY[place], columns=QUANTITIES).assign(tooth=tooth)
    return frame(x), labels


@pytest.fixture(scope="module")
def training(bank):
    return drawn(bank, np.random.default_rng(11), 6000)


@pytest.fixture(scope="module")
def test_rows(bank):
    return drawn(bank, np.random.default_rng(12), 12_000)


@pytest.fixture(scope="module")
def location(bank, training):
    return TemplateLocation(bank).fit(training[0], training[1]["tooth"])


@pytest.fixture(scope="module")
def severity(bank, training):
    return TemplateSeverity(bank).fit(*training)


# The scores


def density(one, turn, x, noise):
    response = np.roll(one.specimen_response[0], turn * STEP, axis=0) @ np.roll(np.eye(TEETH), -turn, axis=0)
    spread = INDEX_ERROR**2 * response @ index_error_covariance(TEETH, MATE) @ response.T
    return multivariate_normal.logpdf(x, np.roll(one.signals[0], turn * STEP), noise**2 * np.eye(N) + spread)


def test_scores_are_log_likelihood_ratios_of_the_normal_laws_written_out(bank):
    laws, share = stored_laws(), bank.points[0].share
    x = np.random.default_rng(4).standard_normal((3, N))
    noise = np.array([0.5, 0.3, 1.0])
    found = TemplateScores(bank).transform(frame(x, noise))
    assert_allclose(found[:, TEETH + 3], noise)
    for row in range(3):
        none = density(laws[0], 0, x[row], noise[row])
        joint = np.array([[density(one, t, x[row], noise[row]) for t in range(TEETH)] for one in laws[1:]])
        joint += np.log(share[1:, None] / TEETH)
        assert_allclose(found[row, :TEETH], logsumexp(joint, axis=0) - none, rtol=1e-4, atol=1e-3)
        weight = np.exp(logsumexp(joint, axis=1) - logsumexp(joint))
        mean = weight @ SEVERITY[1:]
        assert_allclose(found[row, TEETH + 4 : TEETH + 7], mean, rtol=1e-3, atol=1e-4)
        spread = np.sqrt(weight @ (SEVERITY[1:] - mean) ** 2)
        assert_allclose(found[row, TEETH + 10 : TEETH + 13], spread, rtol=1e-3, atol=1e-4)
        for target in range(3):
            below = weight[SEVERITY[1:, target] < found[row, TEETH + 7 + target]].sum()
            above = weight[SEVERITY[1:, target] > found[row, TEETH + 7 + target]].sum()
            assert max(below, above) <= 0.5 + 1e-6


def test_scores_have_names(bank):
    names = TemplateScores(bank).get_feature_names_out().tolist()
    assert names[3:9] == ["tooth_4", "reduced_chi2", "surprise", "surprise_place", "noise", "mean_stiffness_loss"]
    assert len(names) == TemplateScores(bank).transform(frame(np.zeros((1, N)))).shape[1]
    named = TemplateScores(bank).set_output(transform="pandas").transform(frame(np.zeros((2, N))))
    assert list(named) == names


def test_the_noise_is_the_scatter_over_the_root_of_the_revolutions(bank):
    x = np.random.default_rng(5).standard_normal((2, N))
    rows = frame(x)
    again = rows.assign(averages=4 * AVERAGES, scatter=2 * rows["scatter"])
    scores = TemplateScores(bank)
    assert_allclose(scores.transform(again), scores.transform(rows), rtol=1e-12)
    assert not np.allclose(scores.transform(rows.assign(averages=4 * AVERAGES)), scores.transform(rows), rtol=1e-3)


def test_threads_and_scores_made_before_give_the_same(bank, training):
    rows = training[0].iloc[:1500]
    expected = TemplateScores(bank).transform(rows)
    assert_array_equal(TemplateScores(bank, n_jobs=2).transform(rows), expected)
    reduced = Batch(table=rows[["teeth"]], reduced={"template_scores": expected})
    assert_array_equal(reduced.reduce(TemplateScores(bank)), expected)


def test_the_reduced_chi_square_of_rows_of_the_law_is_about_one(bank, test_rows):
    """Under the true hypothesis N times it is chi-square of N degrees; the most likely one is no worse."""
    reduced_chi2 = TemplateScores(bank).transform(test_rows[0])[:, TEETH]
    error = math.sqrt(2 / N / len(reduced_chi2))
    assert 1 - 5 / N < reduced_chi2.mean() < 1 + 4 * error


def test_the_nearest_operating_point_is_taken():
    two = TemplateBank(
        sensor="casing", index_error=INDEX_ERROR, points=(point(1000.0, 10.0, 3), point(1100.0, 10.0, 4))
    )
    x = np.random.default_rng(6).standard_normal((4, N))
    rows = frame(x).assign(speed_rpm=[1000.0, 1040.0, 1060.0, 2000.0])
    alone = [
        TemplateScores(TemplateBank(sensor="casing", index_error=INDEX_ERROR, points=(one,))) for one in two.points
    ]
    first, second = (one.transform(rows) for one in alone)
    assert_array_equal(TemplateScores(two).transform(rows), np.concatenate([first[:2], second[2:]]))


# Location


@pytest.mark.parametrize("j", [1, 3, 4, -2])
def test_turning_the_average_turns_the_probabilities(location, test_rows, j):
    rows = test_rows[0].iloc[:200]
    turned = rows.assign(tsa=[np.roll(x, j * STEP) for x in rows["tsa"]])
    before, after = location.predict_proba(rows), location.predict_proba(turned)
    assert_allclose(after[:, 1:], np.roll(before[:, 1:], j, axis=1), rtol=0, atol=1e-12)
    sets, turned_sets = location.predict_set(rows), location.predict_set(turned)
    assert_array_equal(turned_sets[:, 1:], np.roll(sets[:, 1:], j, axis=1))
    assert_array_equal(turned_sets[:, 0], sets[:, 0])


def test_clean_averages_are_recognised(bank, location, severity):
    place, tooth = np.repeat(np.arange(5), TEETH), np.tile(np.arange(1, TEETH + 1), 5)
    clean = np.stack(
        [np.roll(bank.points[0].hypotheses.signal[k], (t - 1) * STEP) for k, t in zip(place, tooth, strict=True)]
    )
    rows = frame(clean, noise=1e-3)
    assert_array_equal(location.predict(rows), np.where(place == 0, 0, tooth))
    found = severity.predict(rows[place > 0])[list(QUANTITIES)].to_numpy()
    assert_allclose(found, SEVERITY[place[place > 0]], atol=1e-3)


def test_under_the_law_itself_there_is_nothing_to_calibrate(location):
    """The slope is 1 and the level of 'none' the logarithm of its odds, 0.3 / 0.7, within the error of 6000 rows."""
    assert location.slope_ == pytest.approx(1, abs=0.1)
    assert location.none_ == pytest.approx(math.log(0.3 / 0.7), abs=0.15)


def test_probabilities_are_reliable(location, test_rows):
    """In each of ten bins of probability as many come true as were foretold, within four standard errors."""
    rows, labels = test_rows
    p = location.predict_proba(rows).ravel()
    true = (labels["tooth"].to_numpy()[:, None] == np.arange(TEETH + 1)).ravel()
    checked = 0
    for low in np.arange(0, 1, 0.1):
        some = (p >= low) & (p < low + 0.1)
        error = math.sqrt((p[some] * (1 - p[some])).sum()) / some.sum()
        assert abs(true[some].mean() - p[some].mean()) < 4 * error + 0.01
        checked += some.sum() > 100
    assert checked == 10


def test_sets_hold_the_truth_as_often_as_promised_healthy_or_not(location, test_rows):
    rows, labels = test_rows
    tooth = labels["tooth"].to_numpy()
    sets = location.predict_set(rows)
    held = sets[np.arange(len(tooth)), tooth]
    for some in (tooth == 0, tooth > 0):
        # Errors of the thresholds, of 1800 and more rows, and of the share.
        error = math.sqrt(0.09 / some.sum() + 0.09 / 1500)
        assert abs(held[some].mean() - 0.9) < 4 * error
    assert 1 < sets.sum(axis=1).mean() < TEETH + 1
    assert sets.any(axis=1).all()


def test_sets_of_rare_healthy_gears_hold_the_truth_as_often(bank, test_rows):
    """One row in twenty of the training is healthy: one threshold for all labels would serve the others only."""
    rows, labels = drawn(bank, np.random.default_rng(13), 8000, healthy=0.05)
    sets = TemplateLocation(bank).fit(rows, labels["tooth"]).predict_set(test_rows[0])
    healthy = (test_rows[1]["tooth"] == 0).to_numpy()
    assert abs(sets[healthy, 0].mean() - 0.9) < 4 * math.sqrt(
        0.09 / healthy.sum() + 0.09 / (labels["tooth"] == 0).sum()
    )


def test_fewer_than_nine_specimens_support_no_smaller_set(bank, training):
    rows, labels = training
    few = TemplateLocation(bank).fit(rows[:800], labels["tooth"][:800], np.arange(800) % 8)
    assert few.predict_set(rows[:20]).all()
    assert set(few.assess(rows[:20])["kind"]) == {"cannot be judged"}


def test_judgement_in_words(location, test_rows):
    rows = test_rows[0].iloc[:400]
    said = location.assess(rows)
    sets, best = location.predict_set(rows), location.predict(rows)
    inside = ~location.fits_none(rows)
    assert (inside <= (said["reduced_chi2"] <= location.reduced_chi2_threshold_)).all()
    assert 0.9 < inside.mean() < 1
    assert said["answer"][~inside].str.startswith("Cannot be judged: none of the templates fits the average").all()
    sure = inside & (sets.sum(axis=1) == 1)
    assert (said["kind"][inside & sets[:, 0] & ~sure] == "cannot be judged").all()
    assert (said["kind"][inside & ~sets[:, 0] & sets.any(axis=1)] == "one tooth").all()
    none = "Nothing stands out of what healthy gears show."
    expected = [f"One tooth stands out: {tooth}." if tooth else none for tooth in best[sure]]
    assert said["answer"][sure].tolist() == expected
    assert {none, "One tooth stands out: 1."} <= set(said["answer"])
    assert [list(one) for one in said["candidates"]] == [np.flatnonzero(one).tolist() for one in sets]


def test_a_residual_that_is_not_white_is_outside_the_database_with_its_place(location, bank, test_rows):
    """A ghost order of a gear that is healthy, which the reduced chi-square does not show."""
    rows, labels = test_rows
    healthy = rows[(labels["tooth"] == 0).to_numpy()].iloc[:200]
    assert 0 <= location.fits_none(healthy).mean() < 0.04
    wave = np.cos(5 * 2 * np.pi * np.arange(N) / N) * 5 * healthy["scatter"].iloc[0] / math.sqrt(AVERAGES)
    said = location.assess(healthy.assign(tsa=[x + wave for x in healthy["tsa"]]))
    assert (said["kind"] == "cannot be judged").mean() > 0.9
    assert said["answer"].str.contains("its residual stands out").mean() > 0.9


def test_what_no_template_resembles_is_outside_the_database(location):
    strange = 3 * np.random.default_rng(7).standard_normal((20, N))
    assert (location.assess(frame(strange))["kind"] == "cannot be judged").all()


# Severity


def test_intervals_cover_each_severity(severity, test_rows):
    rows, labels = test_rows
    damaged = (labels["tooth"] > 0).to_numpy()
    found, true = severity.predict(rows[damaged]), labels[damaged]
    for target in QUANTITIES:
        inside = (found[f"{target}_low"].to_numpy() <= true[target].to_numpy()) & (
            true[target].to_numpy() <= found[f"{target}_high"].to_numpy()
        )
        for level in np.unique(true[target]):
            some = (true[target] == level).to_numpy()
            # Errors of the share, and of a threshold from a third of the training's 4200 damaged rows.
            assert inside[some].mean() > 0.9 - 4 * math.sqrt(0.09 / some.sum() + 0.09 / 1200)
        assert (found[f"{target}_low"] <= found[target]).all()
        assert (found[target] <= found[f"{target}_high"]).all()


def test_estimates_are_the_posterior_median(severity, test_rows):
    """Nothing is learnt for them, so that they do not depend on which severities the training rows have."""
    rows, labels = test_rows
    batch = Batch.from_rows(rows[(labels["tooth"] > 0).to_numpy()], severity.reads)
    median = severity.reducer.severities(batch)["median"]
    assert_allclose(severity.predict(batch)[list(QUANTITIES)], median)


# Detection


@pytest.mark.parametrize("rate", [0.1, 0.01])
def test_false_alarms_are_as_rare_as_asked(location, training, test_rows, rate):
    """At most the rate, and not much rarer: the bound of 1800 independent rows lies 1.64 standard errors above."""
    detector = Detector(FrozenEstimator(location), false_alarm_rate=rate).fit(training[0], training[1]["tooth"])
    rows, labels = test_rows
    alarms = detector.predict(rows)
    healthy = (labels["tooth"] == 0).to_numpy()
    error = math.sqrt(rate * (1 - rate) * (1 / healthy.sum() + 1 / detector.healthy_rows_))
    expected = rate - 1.645 * math.sqrt(rate * (1 - rate) / detector.healthy_rows_)
    assert abs(alarms[healthy].mean() - expected) < 4 * error
    assert alarms[~healthy].mean() > 2 * rate


def test_the_score_is_the_log_odds_of_the_scorer(location, training):
    detector = Detector(FrozenEstimator(location), false_alarm_rate=0.1).fit(training[0], training[1]["tooth"])
    rows = training[0].iloc[:5]
    scores = location.decision_function(rows)
    odds = logsumexp(scores[:, 1:], axis=1) - scores[:, 0]
    assert_allclose(detector.log_ratio(rows), odds, rtol=1e-12)
    assert_allclose(detector.decision_function(rows), odds - detector.thresholds_[0], rtol=1e-12)


# Conventions and messages


def test_parameters_and_kinds(bank):
    for made in (TemplateLocation, TemplateSeverity):
        one = made(bank, coverage=0.2)
        assert set(one.get_params()) == {"bank", "coverage", "coverage_by", "n_jobs"}
        assert clone(one).get_params()["coverage"] == 0.2
        assert "5 templates of 'casing' at 1 points" in repr(one)
    assert is_classifier(TemplateLocation(bank))
    assert is_classifier(Detector(TemplateLocation(bank)))
    assert is_regressor(TemplateSeverity(bank))


@pytest.mark.parametrize("column", ["teeth", "speed_rpm", "torque", "averages", "scatter", "tsa"])
def test_a_missing_column_is_named(bank, column):
    with pytest.raises(InputError, match=rf"X lacks the columns \['{column}'\]; give rows of Database.features"):
        TemplateScores(bank).transform(frame(np.zeros((2, N))).drop(columns=column))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"teeth": 7}, "teeth = 7 is not in the bank of templates, which has 4; train on a database"),
        ({"scatter": [1.0, np.nan]}, "scatter = nan must be above 0: .* averages of 2 revolutions or more"),
        ({"scatter": [0.0, 1.0]}, "scatter = 0 must be above 0"),
        ({"tsa": [np.zeros(28), np.zeros(28)]}, "tsa has 28 samples, but the bank's averages of 4 teeth have 24"),
        ({"tsa": [np.zeros(N), np.zeros(28)]}, r"tsa of gears of 4 teeth has \[24, 28\] values; give arrays of one"),
        ({"tsa": [np.zeros(30), np.zeros(30)]}, "tsa holds 30 values, which do not fit 4 teeth"),
        ({"tsa": [np.zeros(N), np.full(N, np.inf)]}, "tsa holds values that are not finite"),
    ],
)
def test_what_cannot_be_read_is_told(bank, changed, said):
    with pytest.raises(InputError, match=said):
        TemplateScores(bank).transform(frame(np.zeros((2, N))).assign(**changed))


def test_labels_are_checked(bank, training):
    rows, labels = training[0].iloc[:50], training[1].iloc[:50]
    with pytest.raises(InputError, match="y holds tooth 9, which its gear does not have"):
        TemplateLocation(bank).fit(rows, np.full(50, 9))
    with pytest.raises(InputError, match="y must hold both healthy rows"):
        TemplateLocation(bank).fit(rows, np.zeros(50, int))
    with pytest.raises(InputError, match="y holds no damaged rows"):
        TemplateSeverity(bank).fit(rows, labels.assign(tooth=0))


# Banks of databases


def test_the_bank_of_a_database(database):
    bank = TemplateBank.of(database)
    (one,) = bank.points
    assert (bank.sensor, bank.teeth, one.samples) == ("pinion-vertical", (12,), 768)
    assert bank.index_error == pytest.approx(1e-6)
    assert one.healthy.sum() == 1
    # Eight kinds of damage, of as many rows each.
    assert_allclose(one.share, np.where(one.healthy, 1, 1 / 8), rtol=1e-12)


class OneRevolution:
    """A database whose averages are of one revolution each."""

    def __init__(self, database):
        self._database = database

    def __getattr__(self, name):
        return getattr(self._database, name)

    def __len__(self):
        return len(self._database)

    def sql(self, query):
        found = self._database.sql(query)
        return found.assign(averages=1) if "averages" in found else found


def test_averages_of_one_revolution_have_no_bank(database):
    with pytest.raises(
        InputError, match=r"averages of 1 revolution, which has no scatter .* set averages to 2 or more"
    ):
        TemplateBank.of(OneRevolution(database))


def test_weights_and_index_errors_are_those_of_the_specimens_given(database):
    """Specimen 5 has greater index errors, and its rows with a phase shift do not count."""
    told = Retold(database)
    seen, every = (TemplateBank.of(told, specimens=some) for some in ([0, 1, 2], None))
    assert seen.index_error == pytest.approx(1e-6)
    assert every.index_error > 2e-6
    assert_allclose(seen.points[0].share, TemplateBank.of(database).points[0].share)
    assert every.points[0].share[~every.points[0].healthy].max() > 1.05 / 8


class Retold:
    """A database in which specimen 5 has other gears, and its rows with a phase shift lose contact."""

    def __init__(self, database):
        self._database = database

    def __getattr__(self, name):
        return getattr(self._database, name)

    def sql(self, query):
        other = "if(specimen = 5, 10 * index_error, index_error) as index_error"
        lost = "specimen = 5 and phase_shift_deg > 0 as contact_loss"
        told = f"(select * replace ({other}, {lost}) from features)"
        return self._database.sql(query.replace("from features", f"from {told}"))


def test_training_without_a_bank_says_so_or_refuses(database, without_boosting):
    steps = []
    model = train(
        OneRevolution(database), "location", RecognitionSettings(folds=3, learner="lda"), on_step=steps.append
    )
    assert "templates" not in model.estimators
    assert list(model.reducers) == ["envelope_peak", "residual_moments"]
    assert steps[0].startswith("templates are left out: ")
    with pytest.raises(InputError, match="averages of 1 revolution"):
        train(OneRevolution(database), "location", RecognitionSettings(folds=3, learner="templates"))
