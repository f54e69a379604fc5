"""Unit: estimators of one's own are trained and evaluated as those of the registry, beside the bound."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.dummy import DummyClassifier, DummyRegressor
from sklearn.impute import SimpleImputer
from sklearn.pipeline import make_pipeline

from sigdb.core import InputError
from sigdb.recognition import evaluate

FEW = ("fm4", "kurtosis")


@pytest.fixture(scope="module")
def registry_of_few():
    from sigdb.recognition.estimators import registry

    kept = tuple(one for one in registry.REGISTRY if one.name in ("templates", "majority"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sigdb.recognition.estimators.registry.REGISTRY", kept)
        yield


@pytest.fixture(scope="module")
def evaluation(database, registry_of_few):
    model = make_pipeline(SimpleImputer(), LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"))
    return evaluate(model, database)


def test_a_pipeline_stands_beside_baselines_and_bound(database, evaluation):
    assert evaluation.learner == "Pipeline"
    assert set(evaluation.metrics) == {"Pipeline", "templates", "majority"}
    assert evaluation.bound["accuracy"].value >= evaluation.metrics["Pipeline"]["accuracy"].value
    assert not evaluation.above
    assert evaluation.metrics["Pipeline"]["accuracy"].value > evaluation.metrics["majority"]["accuracy"].value
    assert evaluation.metrics["Pipeline"]["log_loss"].value > evaluation.bound["log_loss"].value


def test_its_accuracy_is_that_of_the_same_model_on_the_first_fold(database, evaluation):
    X, y, _, cv = database.xy("location")
    train, test = cv[0]
    model = make_pipeline(SimpleImputer(), LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"))
    answers = model.fit(X.iloc[train], y.iloc[train]).predict(X.iloc[test])
    assert evaluation.metrics["Pipeline"]["accuracy"].value == pytest.approx(np.mean(answers == y.iloc[test]))


def test_severity_and_detection_without_probabilities(database, registry_of_few):
    severity = evaluate(DummyRegressor(), database, target="severity", columns=FEW, bound=False)
    true = database.cases("tooth > 0")["stiffness_loss"]
    expected = np.abs(true - true.mean()).mean()
    assert severity.metrics["DummyRegressor"]["mae_stiffness_loss"].value == pytest.approx(expected, rel=1e-6)
    detection = evaluate(
        DummyClassifier(strategy="constant", constant=1), database, target="detection", columns=FEW, bound=False
    )
    assert detection.metrics["DummyClassifier"]["false_alarm_rate"].value == 1
    assert detection.metrics["DummyClassifier"]["p_detected"].value == 1


class Counting(DummyClassifier):
    """A classifier that keeps the number of rows that it is trained on."""

    trained_on = 0

    def fit(self, X, y):
        Counting.trained_on = len(X)
        return super().fit(X, y)


def test_it_is_trained_alone_on_all_rows_or_on_those_drawn(database, registry_of_few, monkeypatch):
    monkeypatch.setattr("sigdb.recognition.training.DRAWN_ROWS", 60)
    alone = evaluate(Counting(), database, columns=FEW, baselines=False, bound=False)
    every = Counting.trained_on
    assert set(alone.metrics) == {"Counting"}
    assert every == len(database.xy("location", columns=FEW).cv[0][0])
    beside = evaluate(Counting(), database, columns=FEW, drawn_rows=True, bound=False)
    assert Counting.trained_on == 60 < every
    assert set(beside.metrics) == {"Counting", "templates", "majority"}


class Wrong(ClassifierMixin, BaseEstimator):
    """A classifier that fails as it is asked to."""

    def __init__(self, wrong="shape"):
        self.wrong = wrong

    def fit(self, X, y):
        if self.wrong == "fit":
            raise RuntimeError("no convergence")
        self.classes_ = np.unique(y)
        return self

    def predict(self, X):
        return np.zeros((len(X), 2) if self.wrong == "shape" else len(X), int)

    def predict_proba(self, X):
        return np.ones((len(X), len(self.classes_)))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("shape", r"Wrong: predict returned the shape \(\d+, 2\); return \(\d+,\)"),
        ("fit", "Wrong.fit: RuntimeError: no convergence"),
        ("sum", "Wrong: predict_proba returned the shape .* whose sum is 1"),
    ],
)
def test_a_wrong_estimator_is_named_with_what_it_did(database, registry_of_few, wrong, message):
    with pytest.raises(InputError, match=message):
        evaluate(Wrong(wrong), database, columns=FEW, bound=False)


@pytest.mark.parametrize("estimator", [DummyClassifier, "location", 3])
def test_what_is_no_estimator_is_refused(database, estimator):
    with pytest.raises(InputError, match="give a model of sigdb, or an instance of an estimator with fit and predict"):
        evaluate(estimator, database)
