"""Unit: nothing but the signature, the tooth count, speed and torque is learnt from."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score

from sigdb.database import QUANTITIES, TEST, TRAINING, make_split
from sigdb.recognition import LocationClassifier, RecognitionSettings, SeverityRegressor, evaluate, train
from sigdb.recognition.rows.tooth_views import COLUMNS
from sigdb.recognition.templates.scores import COLUMNS as TEMPLATE_COLUMNS
from sigdb.recognition.training import usable_rows

LABELS = ["tooth", *QUANTITIES]
LEARNERS = ("lda", "boosting", "templates")
READ = {"lda": COLUMNS, "boosting": COLUMNS, "templates": TEMPLATE_COLUMNS}


class Shuffled:
    """A database whose labels are dealt out anew among the rows of each specimen, in training and test alike."""

    def __init__(self, database):
        self._database, self._labels = database, {}

    def __getattr__(self, name):
        return getattr(self._database, name)

    def __len__(self):
        return len(self._database)

    def sql(self, query):
        rows = self._database.sql(query)
        if not {"specimen", *LABELS} <= set(rows):
            return rows
        stream = np.random.default_rng(8)
        for specimen in sorted(rows["specimen"].unique()):
            mine = (rows["specimen"] == specimen).to_numpy()
            rows.loc[mine, LABELS] = stream.permutation(rows.loc[mine, LABELS].to_numpy())
        return rows.astype({"tooth": int, "damaged_teeth": int})


@pytest.fixture(scope="module")
def guesses(database):
    """Evaluations of what was trained on shuffled labels, by target: every learner and every baseline."""
    shuffled = Shuffled(database)
    return {
        target: evaluate(train(shuffled, target, RecognitionSettings(folds=3)), shuffled, bound=False)
        for target in DIFFERENCES
    }


DIFFERENCES = {"location": {}, "severity": {"stiffness_loss": 0.2, "phase_shift_deg": 2.0, "damaged_teeth": 1.0}}
"""Between the two levels of each severity, which are equally frequent."""


def test_location_of_shuffled_labels_is_guesswork(guesses):
    evaluation = guesses["location"]
    assert {*LEARNERS, "whitened_bank", "nearest_template", "envelope_peak", "na4_star", "fm4", "majority"} == set(
        evaluation.metrics
    )
    for figures in evaluation.metrics.values():
        # One tooth in twelve by chance; four standard deviations of a share of 192 rows are 0.08.
        assert figures["p_exact"].value < 1 / 12 + 0.08
        assert figures["p_within_one"].value < 3 / 12 + 4 * np.sqrt(0.25 * 0.75 / 192)
    # Damage is called as often as it is a false alarm, of 192 damaged and 48 healthy rows.
    table = evaluation.tables["roc"]
    assert {*LEARNERS, "fm4"} < set(table["estimator"])
    assert (table["detected"] - table["false_alarm_rate"]).abs().max() < 4 * np.sqrt(0.25 * (1 / 192 + 1 / 48))


# The FM4 baseline cannot know whether a shuffled label rises or falls.
@pytest.mark.filterwarnings("ignore:Confidence interval of the Spearman:UserWarning")
def test_severity_of_shuffled_labels_is_guesswork(guesses):
    """A guess between two equally frequent levels errs by their half distance on average, with as great a deviation:
    the bound is four standard deviations of the mean of 192 rows."""
    evaluation = guesses["severity"]
    assert evaluation.rows == 192
    assert {*LEARNERS, "fm4", "majority"} == set(evaluation.metrics)
    for target, difference in DIFFERENCES["severity"].items():
        half = difference / 2
        assert evaluation.metrics["majority"][f"mae_{target}"].value == pytest.approx(half, rel=1e-6)
        for figures in evaluation.metrics.values():
            assert figures[f"mae_{target}"].value > half * (1 - 4 / np.sqrt(192))


def test_noise_level_and_noise_draw_tell_nothing_of_the_damage(database):
    """What is measured of the noise of a row, and which draw it is, learnt with the labels under S1."""
    rows = database.features()
    folds = make_split("S1", rows, seed=1, folds=3).folds(rows)
    noise = rows[["scatter", "snr_db", "averages", "index_error"]].assign(of_median=lambda one: one["scatter"].rank())
    learnt = HistGradientBoostingClassifier(max_iter=20, early_stopping=False, random_state=0)
    learnt.fit(noise[folds == TRAINING], rows["tooth"][folds == TRAINING])
    tooth = rows["tooth"][folds == TEST].to_numpy()
    damaged = tooth > 0
    found = learnt.predict_proba(noise[folds == TEST])
    assert (found[damaged, 1:].argmax(axis=1) + 1 == tooth[damaged]).mean() < 1 / 12 + 4 * np.sqrt(
        1 / 12 * 11 / 12 / 192
    )
    # The standard deviation of the area under the curve without information (Mann and Whitney).
    error = np.sqrt((192 + 48 + 1) / (12 * 192 * 48))
    assert roc_auc_score(damaged, 1 - found[:, 0]) == pytest.approx(0.5, abs=4 * error)


def test_no_estimator_reads_ids_labels_or_the_law_of_the_noise(location_model, severity_model, held_out):
    """Ids tell the case, since a plan numbers the cases in turn: no estimator may see them, or what is not measured."""
    stream = np.random.default_rng(5)
    measured = list(dict.fromkeys((*COLUMNS, *TEMPLATE_COLUMNS, "fm4")))
    hidden = held_out[measured].set_axis(stream.permutation(len(held_out)))
    for model in (location_model, severity_model):
        for estimator in model.estimators.values():
            expected = np.asarray(estimator.predict(held_out))
            assert_array_equal(np.asarray(estimator.predict(hidden)), expected)


def test_the_split_is_the_same_for_any_order_and_numbering_of_the_rows(database, location_model):
    rows = usable_rows(database, "location")
    order = np.random.default_rng(6).permutation(len(rows))
    shuffled = rows.iloc[order].set_axis(np.arange(len(rows)))
    split = make_split("S1", shuffled, seed=1, folds=3)
    assert split.hash == location_model.split_hash
    assert set(shuffled["specimen"][split.folds(shuffled) == TRAINING]) == set(location_model.trained_on)


def test_the_order_of_rows_permutes_the_answers_only(location_model, severity_model, held_out):
    order = np.random.default_rng(2).permutation(len(held_out))
    for name in LEARNERS:
        answer = location_model.estimators[name].decision_function(held_out)
        permuted = location_model.estimators[name].decision_function(held_out.iloc[order])
        assert_allclose(permuted, answer[order], rtol=1e-9, atol=1e-12)
        severity = severity_model.estimators[name].predict(held_out)
        permuted = severity_model.estimators[name].predict(held_out.iloc[order])
        assert permuted.index.equals(held_out.index[order])
        assert_allclose(permuted.to_numpy(), severity.to_numpy()[order], rtol=1e-9, atol=1e-12)


def test_other_columns_change_no_answer(location_model, severity_model, held_out):
    stream = np.random.default_rng(4)
    for name, read in READ.items():
        changed = held_out.copy()
        for other in set(held_out) - set(read):
            changed[other] = stream.permutation(held_out[other].to_numpy())
        changed = changed.set_axis(stream.permutation(len(changed)) + 10_000)
        bare = held_out[list(read)]
        estimator = location_model.estimators[name]
        expected = estimator.decision_function(held_out)
        assert_array_equal(estimator.decision_function(changed), expected)
        assert_array_equal(estimator.decision_function(bare), expected)
        estimator = severity_model.estimators[name]
        expected = estimator.predict(held_out).to_numpy()
        assert_array_equal(estimator.predict(changed).to_numpy(), expected)
        assert_array_equal(estimator.predict(bare).to_numpy(), expected)


def test_other_columns_change_no_training(rows):
    training = rows[rows["specimen"] < 4]
    bare = training[list(COLUMNS)].reset_index(drop=True)
    groups = training["specimen"].to_numpy()
    both = [LocationClassifier("lda").fit(X, training["tooth"].to_numpy(), groups) for X in (training, bare)]
    assert_array_equal(both[0].decision_function(rows), both[1].decision_function(rows))
    both = [SeverityRegressor("lda").fit(X, training[LABELS].set_axis(X.index), groups) for X in (training, bare)]
    assert_array_equal(both[0].predict(rows).to_numpy(), both[1].predict(rows).to_numpy())


def test_names_of_specimens_do_not_matter(rows):
    training = rows[rows["specimen"] < 4]
    renamed = 100 + 7 * training["specimen"]  # keeps their order, by which the calibration's share is drawn
    both = [
        LocationClassifier("lda").fit(training, training["tooth"], groups) for groups in (training["specimen"], renamed)
    ]
    assert_array_equal(both[0].decision_function(rows), both[1].decision_function(rows))


def test_the_level_of_none_is_calibrated_on_specimens_that_the_scorer_has_not_seen(rows):
    class Witness(LocationClassifier):
        def _fit_scorer(self, X, y):
            seen.append(sorted(X.table["specimen"].unique()))
            assert len(X) == 120 * len(seen[-1])  # whole specimens
            return super()._fit_scorer(X, y)

    seen = []
    Witness("lda").fit(rows, rows["tooth"], rows["specimen"])
    assert [len(one) for one in seen] == [3, 3, 6]
    assert not set(seen[0]) & set(seen[1])


def test_speed_and_torque_are_inputs(rows):
    training = rows[rows["specimen"] < 4].copy()
    stream = np.random.default_rng(6)
    training["torque"] *= stream.uniform(0.8, 1.2, len(training))
    y = training[LABELS].assign(stiffness_loss=training["torque"] / training["torque"].max())
    regressor = SeverityRegressor("lda").fit(training, y, training["specimen"])
    error = (regressor.predict(training)["stiffness_loss"] - y["stiffness_loss"]).abs()[training["tooth"] > 0]
    assert error.max() < 0.1 * y["stiffness_loss"].std()
