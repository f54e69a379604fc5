"""Unit: prevalence moves the log odds of damage, and costs choose the answer of least expected cost."""

import numpy as np
import pytest

from sigdb.core.errors import InputError
from sigdb.recognition import Costs, Detector
from sigdb.recognition.answers import Answers
from sigdb.recognition.decision import check_decision, decided_answers, with_prevalence
from sigdb.recognition.estimators.contract import Scorer, SeverityEstimator

TRAINED = 0.8


class Fixed(Scorer):
    """A scorer of stated probabilities, calibrated at a prevalence of 0.8."""

    def __init__(self, probabilities=None, prevalence=TRAINED):
        self.probabilities = probabilities
        self.prevalence_ = prevalence

    def fit(self, X, y, groups=None):
        return self

    def decision_function(self, X):
        return np.log(self.probabilities)

    def answer(self, X):
        return Answers.of_scores(self.decision_function(X), sets=np.ones(self.probabilities.shape, bool))


class AnyRatio(Detector):
    """A detector of stated log ratios, whose threshold is 2."""

    def __init__(self, ratio=None):
        self.ratio = ratio

    def log_ratio(self, X):
        return self.ratio

    def decision_function(self, X):
        return self.ratio - 2.0


class AnySeverity(SeverityEstimator):
    def fit(self, X, y, groups=None):
        return self

    def predict(self, X):
        raise AssertionError


P = np.array([[0.3, 0.6, 0.1], [0.05, 0.5, 0.45], [0.7, 0.2, 0.1]])


@pytest.mark.parametrize("prevalence", [0.001, 0.2, 0.8, 0.99])
def test_probabilities_follow_bayes_rule_with_another_prevalence(prevalence):
    """With the likelihoods p / prior of each class."""
    prior, other = (np.array([1 - share, share / 2, share / 2]) for share in (TRAINED, prevalence))
    expected = P / prior * other
    answers = decided_answers(Fixed(P), None, prevalence, None)
    np.testing.assert_allclose(answers.probabilities, expected / expected.sum(axis=1, keepdims=True), rtol=1e-12)
    assert answers.predicted.tolist() == expected.argmax(axis=1).tolist()
    assert answers.sets.all()


@pytest.mark.parametrize(
    "costs", [{}, {"miss": 20}, {"false_alarm": 20}, {"wrong_tooth": 9, "miss": 2}, {"wrong_tooth": 0, "miss": 0}]
)
def test_the_answer_costs_least(costs):
    """Each expected cost written out: rows are truths, columns answers."""
    stated = Costs(**costs)
    table = np.array(
        [
            [0, stated.false_alarm, stated.false_alarm],
            [stated.miss, 0, stated.wrong_tooth],
            [stated.miss, stated.wrong_tooth, 0],
        ]
    )
    answers = decided_answers(Fixed(P), None, None, stated)
    expected = (P @ table).argmin(axis=1)
    assert answers.predicted.tolist() == expected.tolist()
    if not costs:
        assert expected.tolist() == P.argmax(axis=1).tolist()


def test_a_detector_answers_at_its_rate_and_by_a_prevalence_and_costs():
    ratio = np.array([-1.0, 1.5, 3.0, 6.0])
    detector = AnyRatio(ratio)
    assert decided_answers(detector, None, None, None).predicted.tolist() == [0, 0, 1, 1]
    rare = decided_answers(detector, None, 0.01, None)
    odds = np.exp(ratio) * 0.01 / 0.99
    np.testing.assert_allclose(rare.probabilities[:, 1], odds / (1 + odds), rtol=1e-12)
    assert rare.predicted.tolist() == (odds > 1).astype(int).tolist()
    dear = decided_answers(detector, None, 0.01, Costs(miss=50))
    assert dear.predicted.tolist() == (50 * odds > 1).astype(int).tolist()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"miss": -1}, "costs: miss = -1 must be a number of 0 or more"),
        ({"false_alarm": float("nan")}, "costs: false_alarm = nan must be"),
        ({"wrong_tooth": "1"}, "costs: wrong_tooth = '1' must be"),
        ({"miss": 0, "false_alarm": 0, "wrong_tooth": 0}, "costs: all are 0"),
    ],
)
def test_costs_without_a_meaning_are_refused(wrong, said):
    with pytest.raises(InputError, match=said):
        Costs(**wrong)


@pytest.mark.parametrize("prevalence", [0, 1, -0.1, 1.5, float("nan"), True, "0.1"])
def test_a_prevalence_that_is_no_share_is_refused(prevalence):
    with pytest.raises(InputError, match="must be between 0 and 1: the share of gears that are damaged"):
        check_decision(Fixed(P), prevalence, None)


def test_models_that_cannot_use_them_say_so():
    with pytest.raises(InputError, match="costs of a model of detection need a prevalence"):
        check_decision(AnyRatio(), None, Costs())
    with pytest.raises(InputError, match="are for models of location and detection"):
        check_decision(AnySeverity(), None, Costs())
    with pytest.raises(InputError, match="does not state that of its training; train it again"):
        check_decision(Fixed(P, prevalence=None), 0.1, None)


def test_answers_without_probabilities_or_a_stated_prevalence_stay_as_they_are():
    answers = Fixed(P).answer(None)
    assert with_prevalence(answers, None, 0.1) is answers
    assert with_prevalence(answers, TRAINED, 1.0) is answers
    bare = Answers(predicted=answers.predicted, scores=answers.scores)
    assert with_prevalence(bare, TRAINED, 0.1) is bare
