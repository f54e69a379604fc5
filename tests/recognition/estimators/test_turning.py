"""Unit: turning the signature turns the location exactly, and leaves the severity as it is."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.database import QUANTITIES
from sigdb.recognition import LocationClassifier, SeverityRegressor
from sigdb.signature import mesh_bands, pooled_wigner_ville

POOLED = ("lda", "boosting")
LEARNERS = (*POOLED, "templates")
TURNS = (1, 5, 11, 12, -3)


def turned_probabilities(probability, teeth, j):
    """Column (t - 1 + j) mod teeth + 1 of the answer is column t of the old one; column 0 and the padding stay."""
    expected = probability.copy()
    for row, count in enumerate(teeth):
        for tooth in range(1, count + 1):
            expected[row, (tooth - 1 + j) % count + 1] = probability[row, tooth]
    return expected


@pytest.fixture(scope="module", params=LEARNERS)
def classifier(request, location_model):
    return location_model.estimators[request.param]


@pytest.fixture(scope="module", params=LEARNERS)
def regressor(request, severity_model):
    return severity_model.estimators[request.param]


@pytest.fixture(scope="module", params=POOLED)
def pooled_classifier(request, location_model):
    return location_model.estimators[request.param]


@pytest.fixture(scope="module", params=POOLED)
def pooled_regressor(request, severity_model):
    return severity_model.estimators[request.param]


@pytest.mark.parametrize("j", TURNS)
def test_turning_the_cells_turns_the_probabilities(classifier, held_out, turned, j):
    some = held_out.iloc[::7]
    before = classifier.predict_proba(some)
    after = classifier.predict_proba(turned(some, j))
    assert_allclose(after, turned_probabilities(before, some["teeth"], j), rtol=0, atol=1e-12)
    found = classifier.predict(some)
    assert_array_equal(classifier.predict(turned(some, j)), np.where(found == 0, 0, (found - 1 + j) % 12 + 1))


def with_tsa(database, where):
    """Rows of one tooth count with their averages."""
    rows = database.features(where)
    return rows.assign(tsa=list(database.signals(rows["id"].to_numpy())["tsa"]))


def recomputed(tsa, teeth):
    """Features of averages as a database stores them: bands of a quarter of the mesh order, lags of two passes."""
    step = tsa.shape[-1] // teeth
    cells = pooled_wigner_ville(tsa, teeth=teeth, bands=mesh_bands(teeth), lag_window=2 * step, n_bins=6 * step)
    return list((cells / (6 * step * step)).reshape(len(tsa), -1))


@pytest.mark.parametrize("j", [1, 7])
def test_turning_the_signal_turns_the_probabilities(classifier, database, held_out, j):
    some = held_out.iloc[::11]
    tsa = database.signals(some["id"])["tsa"].astype(float)
    unturned = some.assign(wigner_ville=recomputed(tsa, 12), tsa=list(tsa))
    assert_allclose(np.stack(unturned["wigner_ville"]), np.stack(some["wigner_ville"].to_list()), rtol=1e-5, atol=1e-6)
    turned = np.roll(tsa, j * tsa.shape[1] // 12, axis=1)
    rolled = some.assign(wigner_ville=recomputed(turned, 12), tsa=list(turned))
    before, after = classifier.predict_proba(unturned), classifier.predict_proba(rolled)
    assert_allclose(after, turned_probabilities(before, some["teeth"], j), rtol=0, atol=1e-9)


@pytest.mark.parametrize("j", TURNS)
def test_turning_leaves_the_severity(regressor, held_out, turned, j):
    damaged = held_out[held_out["tooth"] > 0].iloc[::5]
    before, after = regressor.predict(damaged), regressor.predict(turned(damaged, j))
    assert list(before)[::3] == list(QUANTITIES)
    assert_allclose(after.to_numpy(), before.to_numpy(), rtol=1e-9, atol=1e-12)


def test_a_tooth_count_that_was_never_seen_has_an_answer(pooled_classifier, mixed_teeth, turned):
    classifier = pooled_classifier
    thirteen = with_tsa(mixed_teeth, "teeth = 13")
    probability = classifier.predict_proba(thirteen)
    assert probability.shape == (len(thirteen), 14)
    assert_allclose(probability.sum(axis=1), 1, rtol=0, atol=1e-12)
    assert (probability[:, 13] > 0).any()
    after = classifier.predict_proba(turned(thirteen, 4))
    assert_allclose(after, turned_probabilities(probability, thirteen["teeth"], 4), rtol=0, atol=1e-12)


def test_severity_answers_a_tooth_count_that_was_never_seen(pooled_regressor, mixed_teeth):
    thirteen = mixed_teeth.features("teeth = 13 and tooth > 0")
    found = pooled_regressor.predict(thirteen)
    assert found.index.equals(thirteen.index)
    assert np.isfinite(found.to_numpy()).all()
    assert found["stiffness_loss"].between(0, 1).all()
    assert (found["damaged_teeth"] >= 1).all()


def test_rows_of_mixed_tooth_counts_are_answered_one_by_one(pooled_classifier, pooled_regressor, mixed_teeth):
    classifier, regressor = pooled_classifier, pooled_regressor
    rows = mixed_teeth.features().sample(frac=1, random_state=3)
    together = classifier.predict_proba(rows)
    assert together.shape == (len(rows), 14)
    twelve = (rows["teeth"] == 12).to_numpy()
    assert_array_equal(together[twelve, 13], 0)
    assert_allclose(together[twelve, :13], classifier.predict_proba(rows[twelve]), rtol=1e-12)
    assert_allclose(together[~twelve], classifier.predict_proba(rows[~twelve]), rtol=1e-12)
    severity = regressor.predict(rows)
    assert severity.index.equals(rows.index)
    assert_allclose(severity[twelve].to_numpy(), regressor.predict(rows[twelve]).to_numpy(), rtol=1e-12)


def test_a_tooth_count_between_two_that_were_seen_is_located(make_database, mixed_teeth):
    grid = 'pinion.teeth = [12, 18]\ntooth = "all"\nstiffness_loss = [0.2, 0.4]'
    rows = make_database(seed=5, specimens=4, healthy=12, grid=grid).features()
    classifier = LocationClassifier("lda").fit(rows, rows["tooth"], rows["specimen"])
    thirteen = mixed_teeth.features("teeth = 13 and tooth > 0")
    assert (classifier.predict(thirteen) == thirteen["tooth"]).mean() > 0.8


def test_training_takes_mixed_tooth_counts(mixed_teeth):
    rows = mixed_teeth.features()
    training, test = rows[rows["specimen"] > 0], rows[rows["specimen"] == 0]
    classifier = LocationClassifier("lda").fit(training, training["tooth"], training["specimen"])
    found = classifier.predict(test)
    damaged = (test["tooth"] > 0).to_numpy()
    assert (found[damaged] == test["tooth"][damaged]).mean() > 0.5
    severity = SeverityRegressor("lda").fit(training, training[["tooth", *QUANTITIES]], training["specimen"])
    errors = (severity.predict(test[damaged])["stiffness_loss"] - test["stiffness_loss"][damaged]).abs()
    assert errors.mean() < 0.1  # half the distance of the two losses: the mean of both would be as bad


def test_probabilities_are_those_of_a_softmax_over_the_scores(classifier, held_out):
    some = held_out.iloc[:40]
    score = classifier.decision_function(some)
    assert score.dtype == np.float64
    raised = np.exp(score - score.max(axis=1, keepdims=True))
    assert_allclose(classifier.predict_proba(some), raised / raised.sum(axis=1, keepdims=True), rtol=1e-12)
    assert np.ptp(score[:, 0]) == 0  # the level of 'none' does not depend on the row
