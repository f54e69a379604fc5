"""Unit: detection as a target: its rate of false alarms, its metrics, its bound, its folder."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sigdb.core import NotApplicableError
from sigdb.pipeline import train_model
from sigdb.recognition import EvaluationError, RecognitionSettings, evaluate, load_model, train
from sigdb.recognition.answers import Answers
from sigdb.recognition.metrics.detection import call_values
from sigdb.recognition.targets.detection import bound_threshold

RATE = 0.2


@pytest.fixture(scope="module")
def detector(many_specimens):
    return train(many_specimens, "detection", RecognitionSettings(folds=3, learner="templates", false_alarm_rate=RATE))


def test_metrics_are_those_of_a_detector(many_specimens, detector):
    metrics = evaluate(detector, many_specimens, bound=False).metrics
    assert list(metrics) == ["lda", "boosting", "templates", "nearest_template", "envelope_peak", "na4_star", "fm4"]
    for one in metrics.values():
        assert {"false_alarm_rate", "p_detected", "pd_at_1e-2", "a90"} <= set(one)
        assert "accuracy" not in one
    for learner in ("lda", "boosting", "templates"):
        assert metrics[learner]["p_detected"].value > 0.9
        # 160 healthy rows of eight specimens; the rate is held with a confidence of 0.95.
        assert metrics[learner]["false_alarm_rate"].value <= RATE


def test_the_bound_detects_no_less_at_its_rate(many_specimens, detector):
    evaluation = evaluate(detector, many_specimens)
    assert evaluation.bound["false_alarm_rate"].value <= RATE
    assert evaluation.bound["p_detected"].value >= evaluation.metrics["templates"]["p_detected"].value - 0.01
    assert evaluation.above == ()
    assert "accuracy" not in evaluation.bound


def test_the_bound_s_threshold_is_passed_by_the_set_share_of_healthy_rows():
    stream = np.random.default_rng(0)
    rows = pd.DataFrame({"tooth": np.repeat([0, 3], 500)})
    score = np.concatenate([stream.normal(0, 1, 500), stream.normal(1, 1, 500)])
    threshold = bound_threshold(score, rows, 0.1)
    assert threshold == np.sort(score[:500])[-51]
    values = call_values((score > threshold).astype(int), rows)
    assert np.nanmean(values["false_alarm_rate"]) == 0.1


def test_a_folder_of_a_detector_gives_its_answers_again(many_specimens, detector, tmp_path, monkeypatch):
    asked = []

    def trained(database, target, settings, **options):
        asked.append((target, settings.learner, settings.false_alarm_rate))
        return replace(detector, learner=settings.learner)

    monkeypatch.setattr("sigdb.pipeline.models.train", trained)
    seen = []
    evaluation = train_model(
        many_specimens,
        "detection",
        tmp_path / "detector",
        learner="lda",
        false_alarm_rate=RATE,
        command="train",
        on_evaluation=seen.append,
    )
    assert seen == [evaluation]
    assert asked == [("detection", "lda", RATE)]
    loaded = load_model(tmp_path / "detector")
    assert (loaded.target, loaded.false_alarm_rate) == ("detection", RATE)
    assert "false-alarm rate of 0.2" in (tmp_path / "detector" / "README.md").read_text(encoding="utf-8")
    assert evaluate(loaded, many_specimens, bound=False).metrics["lda"] == evaluation.metrics["lda"]


def test_training_refuses_a_model_above_the_bound_once_it_is_written(many_specimens, detector, tmp_path, monkeypatch):
    def too_good(model, database, **options):
        found = evaluate(model, database, bound=False)
        return type(found)(**{**vars(found), "bound": found.metrics[model.learner], "above": ("p_detected",)})

    monkeypatch.setattr("sigdb.pipeline.models.train", lambda *given, **options: detector)
    monkeypatch.setattr("sigdb.pipeline.models.evaluate", too_good)
    given = {"learner": "lda", "false_alarm_rate": RATE, "command": "train"}
    with pytest.raises(EvaluationError, match="better than the best possible answer"):
        train_model(many_specimens, "detection", tmp_path / "leaking", **given)
    assert (tmp_path / "leaking" / "README.md").exists()
    assert train_model(many_specimens, "detection", tmp_path / "told", **given, check=False).above == ("p_detected",)


def test_detectors_whose_rows_do_not_support_the_rate_are_left_out(many_specimens, without_boosting, monkeypatch):
    """All but the templates learn from a part of the rows, which may hold too few healthy ones."""

    def too_few(estimator, *given):
        raise NotApplicableError("too few healthy rows")

    monkeypatch.setattr("sigdb.recognition.estimators.baselines.threshold.IndicatorScore.fit", too_few)
    steps, settings = [], RecognitionSettings(folds=3, learner="templates", false_alarm_rate=RATE)
    model = train(many_specimens, "detection", settings, on_step=steps.append)
    assert list(model.estimators) == ["lda", "templates"]
    assert "fm4 is left out: too few healthy rows" in steps
    monkeypatch.setattr("sigdb.recognition.estimators.pooled_location.LocationClassifier.fit", too_few)
    with pytest.raises(NotApplicableError, match="too few healthy rows"):
        train(many_specimens, "detection", RecognitionSettings(folds=3, learner="lda", false_alarm_rate=RATE))


def test_scores_give_answer_and_probabilities():
    scores = np.log([[0.2, 0.5, 0.3], [0.6, 0.1, 0.3]])
    answers = Answers.of_scores(scores)
    assert answers.predicted.tolist() == [1, 0]
    np.testing.assert_allclose(answers.probabilities, np.exp(scores))
    np.testing.assert_allclose(answers.detection, np.log([0.8 / 0.2, 0.4 / 0.6]))


def test_answers_of_gears_with_other_tooth_counts_are_joined():
    joined = Answers.concatenate([Answers.of_scores(np.zeros((2, width))) for width in (3, 4)])
    assert joined.scores[0].tolist() == [0, 0, 0, -np.inf]
    np.testing.assert_allclose(joined.probabilities.sum(axis=1), 1)
