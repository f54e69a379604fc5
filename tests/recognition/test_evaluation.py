"""Unit: the evaluation of a model with baselines and bound, and its verdict on a model that is too good."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import softmax

from sigdb.core import InputError, NotApplicableError
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition import (
    TARGETS,
    Bound,
    CriteriaSettings,
    EvaluationError,
    Hypotheses,
    RecognitionSettings,
    above_bound,
    bayes_bound,
    bound_text,
    evaluate,
    metric_table,
    requested_rows,
    train,
)
from sigdb.recognition.answers import Answers
from sigdb.recognition.estimators.contract import Scorer
from sigdb.recognition.evaluated_rows import Selection
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.training import usable_rows


@pytest.fixture(scope="module")
def location(location_model, database):
    return evaluate(location_model, database, bound=False)


@pytest.fixture(scope="module")
def severity(severity_model, database):
    return evaluate(severity_model, database, bound=False)


class Oracle(Scorer):
    """Knows the tooth; a share of its answers it gets wrong."""

    def __init__(self, wrong=0.0):
        self.wrong = wrong

    def fit(self, X, y, groups=None):
        return self

    def decision_function(self, X):
        table = Batch.from_rows(X).table
        scores = np.zeros((len(table), 1 + int(table["teeth"].max())))
        wrong = np.random.default_rng(0).random(len(table)) < self.wrong
        scores[np.arange(len(table)), np.where(wrong, 0, table["tooth"])] = 10.0
        return scores

    def answer(self, X):
        scores = self.decision_function(X)
        return Answers.of_scores(scores, sets=softmax(scores, axis=1) > 0.5)


def requested(model, database, estimator, **options):
    return evaluate(replace(model, learner="oracle", estimators={"oracle": estimator}), database, **options)


def test_metrics_that_an_estimator_has_no_answers_for_are_left_out(location):
    assert {"accuracy", "log_loss", "pd_at_1e-3", "a90"} <= set(location.metrics["lda"])
    assert "log_loss" not in location.metrics["fm4"]
    # 48 healthy rows resolve no rate of 1e-2, and 240 rows no calibration error.
    assert all(np.isnan(location.metrics["lda"][name].value) for name in ("pd_at_1e-2", "a90", "ece"))
    titles = [row[0] for row in metric_table(location).rows]
    assert "P(exact tooth)" in titles
    assert not [title for title in titles if "false alarms" in title or "ECE" in title]


def test_differences_are_those_of_the_metrics(location, severity):
    for evaluation, name in ((location, "p_exact"), (severity, "mae_stiffness_loss")):
        ours = evaluation.metrics[evaluation.learner][name].value
        assert set(evaluation.differences) == set(evaluation.metrics) - {evaluation.learner}
        for other, figures in evaluation.differences.items():
            assert figures[name].value == pytest.approx(ours - evaluation.metrics[other][name].value, abs=1e-12)


def test_tables_of_location(location, location_model, database):
    rows = requested_rows(location_model, database)
    confusion = location.tables["confusion"]
    assert confusion["rows"].sum() == len(rows)
    right = confusion[confusion["tooth"] == confusion["predicted"]]["rows"].sum() / len(rows)
    figures = location.metrics[location.learner]
    assert right == pytest.approx(figures["accuracy"].value)
    against = location.tables["snr_db"].query("metric == 'p_exact' and estimator == @location.learner")
    assert against["at"].tolist() == [10.0]
    assert against["value"].tolist() == pytest.approx([figures["p_exact"].value])


def test_tables_of_severity(severity):
    levels = severity.tables["levels"].query("estimator == 'lda' and quantity == 'stiffness_loss' and metric == 'mae'")
    assert levels["level"].tolist() == [0.2, 0.4]
    # As many rows at each level.
    assert levels["value"].mean() == pytest.approx(severity.metrics["lda"]["mae_stiffness_loss"].value)
    scatter = severity.tables["scatter"]
    assert len(scatter) == 3 * severity.rows
    assert ((scatter["low"] <= scatter["estimate"]) & (scatter["estimate"] <= scatter["high"])).all()
    assert "coverage" not in severity.tables  # no cell has 2000 rows


def test_sets_are_judged_where_an_estimator_gives_them(location_model, database):
    figures = requested(location_model, database, Oracle(0.25), bound=False).metrics["oracle"]
    assert figures["set_size"].value == 1
    assert figures["set_coverage"].value == pytest.approx(figures["accuracy"].value)
    assert figures["set_coverage_healthy"].value == 1
    assert figures["set_coverage_damaged"].value == pytest.approx(figures["p_exact"].value)


def test_json_has_no_nan_and_all_metrics(location, severity):
    for evaluation in (location, severity):
        read = json.loads(json.dumps(evaluation.as_json(), allow_nan=False))
        assert read["bound"] is None
        for name, metrics in evaluation.metrics.items():
            for metric, value in metrics.items():
                expected = None if np.isnan(value.value) else value.value
                assert read["metrics"][name][metric]["value"] == expected


def bound_right_in(monkeypatch, share, among=lambda rows: rows.index == rows.index):
    """Replace the bound by one that is right in this share of the rows inside its law, of each specimen alike."""

    def bayes_bound(database, ids, **options):
        rows = usable_rows(database, "location").loc[ids]
        rows = rows[among(rows)]
        right = (rows.groupby("specimen").cumcount() % 10 < 10 * share).to_numpy()
        answers = rows[["tooth", "teeth", "specimen"]].assign(
            predicted=np.where(right, rows["tooth"], rows["teeth"] + 1), log_odds=0.0
        )
        losses = pd.DataFrame({"error": 1.0 - right, "log_loss": 1.0}, rows.index)
        return Bound(
            target="location", rows=answers, losses=losses, scores=None, outside={}, expected=None, entropy=1.0
        )

    monkeypatch.setattr("sigdb.recognition.targets.best_answers.bayes_bound", bayes_bound)
    monkeypatch.setattr("sigdb.recognition.evaluation.efficiency_table", lambda *parts: pd.DataFrame())
    monkeypatch.setattr(Bound, "index_error", 1e-6)


def test_a_model_above_the_bound_fails_loudly(location_model, database, monkeypatch):
    bound_right_in(monkeypatch, 0.5)
    evaluation = requested(location_model, database, Oracle())
    assert evaluation.above == ("accuracy", "log_loss")
    with pytest.raises(EvaluationError, match=r"'oracle' is better than .* \(accuracy 1.000 .* against 0.5"):
        evaluation.check()
    table = metric_table(evaluation)
    assert [table.head[-1], table.rows[0][-1]] == ["bound", evaluation.bound["accuracy"]]


def test_who_has_seen_the_specimens_may_be_above_the_bound(location_model, database, monkeypatch):
    """Under S0, on other draws of the training's gears; the bound is for unseen gears."""
    bound_right_in(monkeypatch, 0.5)
    seen = usable_rows(database, "location")
    seen = seen[seen["specimen"].isin(location_model.trained_on)]
    for selection in (Selection(split="S0", text="new noise", seen=True), Selection(split="S1", text="by specimen")):
        monkeypatch.setattr("sigdb.recognition.evaluation.select_rows", lambda *args, how=selection: (seen, how))
        above = requested(location_model, database, Oracle()).above
        assert ("accuracy" in above) == (not selection.seen)


def test_a_model_at_or_below_the_bound_passes(location_model, database, monkeypatch):
    bound_right_in(monkeypatch, 1.0)
    for wrong in (0.0, 0.5):
        evaluation = requested(location_model, database, Oracle(wrong))
        assert "accuracy" not in evaluation.above


def test_the_bound_is_stated_with_known_cells_and_with_the_whole_grid(location_model, database, monkeypatch):
    """The rule of the first bound knows that all rows have one kind of damage; that of the second does not."""
    rows = usable_rows(database, "location")
    one_kind = (rows["stiffness_loss"] == 0.2) & (rows["phase_shift_deg"] == 0) & (rows["damaged_teeth"] == 1)
    some = rows[one_kind & ~rows["specimen"].isin(location_model.trained_on)]
    selection = Selection(split="S2", text="some")
    monkeypatch.setattr("sigdb.recognition.evaluation.select_rows", lambda *args: (some, selection))
    evaluation = requested(location_model, database, Oracle())
    known, whole = (bound["log_loss"].value for bound in (evaluation.bound, evaluation.bound_whole_grid))
    assert known <= whole  # the signals are plain: both are near 0
    assert metric_table(evaluation).head[-2:] == ["bound", "bound, whole grid"]
    assert "It knows which cases occur" in bound_text(evaluation)


def test_the_bound_stands_in_the_table_against_noise(location_model, database, monkeypatch):
    """A bound whose law does not cover all rows is compared on those that it covers."""
    bound_right_in(monkeypatch, 0.5, among=lambda rows: rows["tooth"] % 2 == 0)
    evaluation = evaluate(location_model, database)
    table = evaluation.tables["snr_db"].query("estimator == 'bound' and metric == 'accuracy'")
    assert table["value"].tolist() == pytest.approx([evaluation.bound["accuracy"].value])


def test_metrics_that_can_be_traded_are_no_bound():
    """Whoever always answers 'none' raises no false alarm: that is no sign of a leak."""
    traded = {"none_on_healthy", "p_detected", "p_exact", "p_within_one", "circular_bias", "false_alarm_rate"}
    bounded = {metric.name for target in TARGETS.values() for metric in target.metrics if metric.bounded}
    assert not traded & bounded
    assert bounded == {
        *("accuracy", "log_loss", "brier", "pd_at_1e-2", "pd_at_1e-3", "pd_at_1e-4"),
        *(f"{kind}_{quantity}" for kind in ("mae", "rmse", "crps") for quantity in SHOWN_QUANTITIES),
    }


def test_rows_outside_the_law_do_not_count(location_model, database, monkeypatch):
    """Right on all that is outside the law, and as good as the bound inside; of all six specimens."""
    model = replace(location_model, trained_on=())
    estimator = _Half(Oracle(0.5))
    bound_right_in(monkeypatch, 0.7)
    assert "accuracy" in requested(model, database, estimator).above
    bound_right_in(monkeypatch, 0.7, among=lambda rows: rows["tooth"] % 2 == 0)
    held = requested(model, database, estimator)
    inside = (requested_rows(model, database)["tooth"] % 2 == 0).sum()
    assert "accuracy" not in held.above
    assert held.bound_rows == inside
    assert f"answer to {inside} of the rows" in bound_text(held)


def test_only_what_is_not_applicable_leaves_the_bound_out(location_model, database, monkeypatch):
    """Rows without a law have no bound; a wrong name of a sensor is an error."""

    def refuse(error):
        def operating_points(*args, **options):
            raise error

        monkeypatch.setattr("sigdb.recognition.bound.bayes_bound.operating_points", operating_points)

    refuse(NotApplicableError("the rig has 2 meshes"))
    evaluation = evaluate(location_model, database)
    assert evaluation.bound is None
    assert [note.text for note in evaluation.notes if note.code == "no-bound"] == ["the rig has 2 meshes"]
    assert "(the Bayes bound) is not computed: the rig has 2 meshes." in bound_text(evaluation)
    refuse(InputError("sensor 'pinoin' is not stored"))
    with pytest.raises(InputError, match="pinoin"):
        evaluate(location_model, database)


@pytest.fixture(scope="module")
def bounded(location_model, severity_model, database):
    """Evaluations with the bound and criteria, each with how often it decomposed templates and drew resamples."""
    criteria = CriteriaSettings(loss_db=0.25, a90_ratio=1.05, mae_ratio=1.05, ece=0.01, undercovered_cells=0.01)
    calls, of, resample = [], Hypotheses.of.__func__, Specimens._resample

    def decompose(cls, *given, **options):
        calls.append("templates")
        return of(cls, *given, **options)

    def counted(model):
        calls.clear()
        return evaluate(model, database, criteria=criteria), tuple(calls)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Hypotheses, "of", classmethod(decompose))
        patch.setattr(Specimens, "_resample", lambda self, count: calls.append(count) or resample(self, count))
        return [counted(model) for model in (location_model, severity_model)]


def test_templates_are_decomposed_once_for_each_operating_point(bounded):
    """They were read and decomposed twice: for the bound, and again for the model's efficiency."""
    for evaluation, calls in bounded:
        assert evaluation.bound is not None
        assert evaluation.bound_whole_grid is None  # the rows have all cases, in the shares of the database
        assert len(evaluation.efficiency) > 0
        assert calls.count("templates") == 1


def test_resamples_are_drawn_once_where_all_rows_have_one_noise(bounded):
    """Every table and metric took its own 1000 resamples before."""
    _, calls = bounded[0]
    assert [call for call in calls if call != "templates"] == [2]


def test_an_evaluation_holds_bound_and_criteria_as_json(bounded):
    evaluations = [evaluation for evaluation, _ in bounded]
    for evaluation in evaluations:
        read = json.loads(json.dumps(evaluation.as_json(), allow_nan=False))
        assert len(read["criteria"]) == len(evaluation.criteria) >= 4
        assert read["efficiency"][-1]["rows"] == evaluation.rows
        assert all(result["note"]["code"] for result in read["criteria"] if result["met"] is not True)
    assert "a90" in evaluations[0].bound
    assert set(evaluations[0].tables["roc"]["estimator"]) > {"bound"}


def test_the_bound_of_a_split_is_of_the_cases_that_it_asks_about(make_database, without_boosting):
    """Much noise, and asked about the middle loss only: who always says it makes no error, and neither does the bound.

    A rule that expects all three losses would be bettered by it.
    """
    grid = 'tooth = "all"\nstiffness_loss = [0.1, 0.2, 0.3]'
    noisy = make_database(specimens=6, healthy=12, grid=grid, snr_db=-28.0)
    model = train(noisy, "severity", RecognitionSettings(folds=3, learner="lda"), split="S2")
    middle = replace(model, learner="majority")
    evaluation = evaluate(middle, noisy, criteria=CriteriaSettings(mae_ratio=1.05))
    assert evaluation.metrics["majority"]["mae_stiffness_loss"].value == pytest.approx(0, abs=1e-9)
    assert evaluation.bound["mae_stiffness_loss"].value == 0
    assert evaluation.above == ()
    assert evaluation.criteria[0].note.code == "one-severity"
    rows = requested_rows(middle, noisy)
    of_all = bayes_bound(noisy, rows.index, target="severity")
    assert above_bound(np.zeros(len(rows)), of_all.losses["absolute_stiffness_loss"], rows["specimen"]).value > 0


class _Half(Oracle):
    """Another estimator's answers where the tooth is even, else the truth."""

    def __init__(self, other):
        super().__init__()
        self.other = other

    def decision_function(self, X):
        even = (Batch.from_rows(X).table["tooth"] % 2 == 0).to_numpy()
        return np.where(even[:, None], self.other.decision_function(X), super().decision_function(X))


def test_a_condition_keeps_the_split_of_all_rows(make_database, without_boosting):
    grid = 'tooth = "all"\nstiffness_loss = [0.1, 0.2, 0.3]'
    noisy = make_database(specimens=9, healthy=12, grid=grid, snr_db=0.0)
    model = train(noisy, "severity", RecognitionSettings(folds=3, learner="lda"), split="S2")
    every = requested_rows(model, noisy)
    # The specimens that are left would be dealt to other folds.
    where = f"specimen in ({every['specimen'].iloc[0]}, {every['specimen'].iloc[-1]}) and tooth = 6"
    some = requested_rows(model, noisy, where)
    assert len(some)
    assert some.index.tolist() == every.index[every.index.isin(noisy.cases(where)["id"])].tolist()
    with pytest.raises(InputError, match="no held-out row of the split S2 meets"):
        requested_rows(model, noisy, "stiffness_loss = 0.1")
