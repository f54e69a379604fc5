"""Unit: which kind of damage, by the same steps as location; scores and bound against Bayes' rule written out."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.special import logsumexp
from sklearn.dummy import DummyClassifier

from sigdb.core import InputError
from sigdb.pipeline import load_recipe
from sigdb.recognition import Hypotheses, RecognitionSettings, bayes_bound, evaluate, load_model, save_model, train
from sigdb.recognition.estimators import registry
from sigdb.recognition.metrics.location_and_severity import kind_values
from sigdb.recognition.training import usable_rows
from sigdb.report import evaluation_html

KINDS = ("none", "loss", "shift + loss")


@pytest.fixture(scope="module")
def model(database):
    kept = tuple(one for one in registry.REGISTRY if one.name in ("lda", "templates", "majority"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sigdb.recognition.estimators.registry.REGISTRY", kept)
        return train(database, "kind", RecognitionSettings(folds=3))


@pytest.fixture(scope="module")
def evaluation(model, database):
    return evaluate(model, database)


@pytest.fixture(scope="module")
def unseen(model, database):
    rows = usable_rows(database, "kind")
    return model.read(database, rows[~rows["specimen"].isin(model.trained_on)])


def kinds_of(rows):
    damaged = np.where(rows["phase_shift_deg"] != 0, "shift + loss", "loss")
    return np.where(rows["tooth"] > 0, damaged, "none")


def test_kinds_are_trained_evaluated_and_stand_beside_the_bound(model, evaluation):
    assert (model.learner, list(model.estimators)) == ("templates", ["lda", "templates", "majority"])
    accuracy = {name: metrics["accuracy"].value for name, metrics in evaluation.metrics.items()}
    assert accuracy["templates"] == evaluation.bound["accuracy"].value == 1  # little noise
    assert accuracy["majority"] == pytest.approx(0.4)  # 96 of 240 rows: four losses at 12 teeth and two specimens
    assert accuracy["majority"] < accuracy["lda"]
    assert not evaluation.above
    assert evaluation.bound["log_loss"].value <= evaluation.metrics["templates"]["log_loss"].value
    assert evaluation.tables["kinds"].to_numpy().tolist() == [
        ["loss", "loss", 96],
        ["none", "none", 48],
        ["shift + loss", "shift + loss", 96],
    ]


def test_answers_have_the_names_of_the_kinds(model, unseen):
    estimator = model.estimator
    predicted, probabilities = model.predict(unseen), model.predict_proba(unseen)
    assert tuple(estimator.classes_) == KINDS == estimator.kinds
    assert_array_equal(predicted, estimator.classes_[probabilities.argmax(axis=1)])
    assert_array_equal(predicted, kinds_of(unseen.table))
    assert estimator.score(unseen, kinds_of(unseen.table)) == 1
    verdict = model.assess(unseen)
    assert_array_equal(verdict["decision"], predicted)
    assert {name for some in verdict["candidates"] for name in some} <= {*KINDS}
    assert_array_equal(model.predict(unseen, prevalence=1 - 1e-9)[predicted != "none"], predicted[predicted != "none"])


def test_the_scores_of_kinds_are_sums_over_templates_and_teeth(model, unseen, database):
    """log p(x | kind) / p(x | none), of densities of all templates at all teeth, weighed as in the bank."""
    some = unseen.take(np.arange(0, len(unseen), 20))
    point = {name: some.table[name].iloc[0].item() for name in ("speed_rpm", "torque", "teeth")}
    laws = Hypotheses.of(database, **point)
    x, bank = some.tsa[point["teeth"]], model.estimator.bank
    density = laws.log_likelihood(x, noise=some.noise(), index_error=bank.index_error)
    assert_array_equal(bank.points[0].healthy, laws.healthy)
    log_p = density + np.log(bank.points[0].share / point["teeth"])[:, None]
    of_kinds = kinds_of(laws.cases)
    expected = [logsumexp(log_p[:, of_kinds == kind], axis=(1, 2)) for kind in KINDS]
    found = model.estimator.reducer.transform(some)
    assert_allclose(found[:, :2], np.array(expected[1:]).T - expected[0][:, None], rtol=1e-4, atol=0.02)
    assert list(model.estimator.reducer.get_feature_names_out()) == [
        *KINDS[1:],
        "reduced_chi2",
        "surprise",
        "surprise_place",
        "noise",
    ]


def test_the_bound_of_kinds_is_the_posterior_summed_over_teeth_and_sizes(database):
    """The prior is the share of each template at each tooth; a healthy gear has no tooth."""
    rows = database.cases().set_index("id").iloc[::3]
    best = bayes_bound(database, rows.index, target="kind")
    every = database.cases()
    laws = Hypotheses.of(database, **{name: every[name].iloc[0].item() for name in ("speed_rpm", "torque", "teeth")})
    noise = np.sqrt(laws.reference_variance[0] / 10 ** (rows["snr_db"] / 10) / rows["averages"]).to_numpy()
    x = database.signals(rows.index.to_numpy())["tsa"]
    density = laws.log_likelihood(x, noise=noise, index_error=rows["index_error"].to_numpy())
    share = np.zeros(density.shape[1:])
    np.add.at(share, (every["template"].to_numpy(), np.maximum(every["tooth"], 1) - 1), 1 / len(every))
    share[laws.healthy] = share[laws.healthy].sum(axis=1, keepdims=True) / share.shape[1]
    with np.errstate(divide="ignore"):
        joint = density + np.log(share)
    joint -= logsumexp(joint, axis=(1, 2), keepdims=True)
    of_kinds, true = kinds_of(laws.cases), kinds_of(rows)
    log_p = pd.DataFrame({kind: logsumexp(joint[:, of_kinds == kind], axis=(1, 2)) for kind in KINDS}, index=rows.index)
    # Below the least float of the most likely one the likeliest tooth stands for all.
    assert_allclose(best.scores[list(KINDS)], log_p, rtol=0.01, atol=1e-8)
    plain = (log_p > -600).to_numpy()
    assert_allclose(best.scores[list(KINDS)].to_numpy()[plain], log_p.to_numpy()[plain], rtol=1e-8, atol=1e-8)
    of_truth = log_p.to_numpy()[np.arange(len(rows)), [KINDS.index(kind) for kind in true]]
    assert_allclose(best.losses["log_loss"], -of_truth, atol=1e-8)
    assert_array_equal(best.rows["true"], true)
    prior = np.array([(kinds_of(every) == kind).mean() for kind in KINDS])
    assert best.entropy == pytest.approx(-(prior * np.log(prior)).sum())


def test_metrics_of_kinds():
    """Two healthy rows, one called damaged; three damaged: right, of another kind, missed."""
    true, predicted = np.array([0, 0, 1, 1, 2]), np.array([0, 1, 1, 2, 0])
    values = kind_values(predicted == true, true > 0, predicted > 0)
    means = {name: np.nanmean(value) for name, value in values.items()}
    assert means == pytest.approx({"accuracy": 0.4, "p_kind": 1 / 3, "p_detected": 2 / 3, "none_on_healthy": 0.5})


def test_a_model_of_kinds_is_saved_loaded_and_shown(model, rows, unseen, evaluation, tmp_path):
    save_model(model, tmp_path, evaluation=evaluation, probe=unseen, command="train")
    loaded = load_model(tmp_path)
    for name in ("lda", "templates", "majority"):
        some = rows.iloc[::20]
        assert_array_equal(loaded.estimators[name].predict(some), model.estimators[name].predict(some))
    assert "the kind of damage of the averaged gear" in (tmp_path / "README.md").read_text(encoding="utf-8")
    page = evaluation_html(evaluation, title="kinds")
    assert "Confusion of kinds" in page
    assert "P(correct kind)" in page


@pytest.mark.parametrize("name", ["lda", "templates"])
def test_turning_an_average_does_not_change_its_kind(model, rows, turned, name):
    some = rows[rows["specimen"].isin(rows["specimen"].unique()[:1])].iloc[::7]
    estimator = model.estimators[name]
    assert_allclose(estimator.decision_function(turned(some, 5)), estimator.decision_function(some), atol=1e-6)


def test_an_estimator_of_one_s_own_answers_with_names(database, monkeypatch):
    kept = tuple(one for one in registry.REGISTRY if one.name == "majority")
    monkeypatch.setattr("sigdb.recognition.estimators.registry.REGISTRY", kept)
    always = DummyClassifier(strategy="constant", constant="loss")
    metrics = evaluate(always, database, target="kind", columns=["fm4"], bound=False).metrics["DummyClassifier"]
    assert (metrics["p_kind"].value, metrics["none_on_healthy"].value) == (0.5, 0)
    y = database.xy("kind", columns=["fm4"]).y
    assert_array_equal(y, kinds_of(database.cases().set_index("id").loc[y.index]))


def test_what_has_no_kinds_to_tell_apart_is_refused(database, many_specimens):
    with pytest.raises(InputError, match="kind cannot be learnt, since kind does not vary over its damaged rows"):
        train(many_specimens, "kind", RecognitionSettings(folds=3))
    for asked in (lambda: train(database, "gear"), lambda: database.xy("gear")):
        with pytest.raises(InputError, match="target = 'gear' cannot be learnt: each row is the average"):
            asked()


def test_kinds_that_the_training_lacked_are_refused(model, make_database):
    other = make_database(seed=5, specimens=3, healthy=3, grid="tooth = [1]\nphase_shift_deg = [2.0]")
    with pytest.raises(InputError, match="rows of the kinds shift, and the model was trained on none, loss, shift"):
        evaluate(model, other)


RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
specimens = 3
healthy = 3

[[sweep.grid]]
tooth = [1]
stiffness_loss = [0.2, 0.4]

[recognition]
folds = 3
targets = ["kind"]
"""


def test_a_recipe_of_one_kind_is_refused_before_it_is_simulated(tmp_path):
    from sigdb.pipeline.recipe_models import check_models

    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(tmp_path / "recipe.toml")
    with pytest.raises(InputError, match=r"kind cannot be learnt, since all damage of \[sweep\] is of one kind"):
        check_models(recipe, recipe.plan(), {})
