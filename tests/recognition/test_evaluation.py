"""Unit: the evaluation of a model beside baselines and bound, and what it does with a model that is too good."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import expit

from sigdb.recognition import Estimate, EvaluationError, evaluate, requested_rows
from sigdb.recognition.answers import Answers
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.metrics.significance import figures_above_bound
from sigdb.recognition.model_card import bound_said, figure_rows
from sigdb.recognition.training import usable_rows


@pytest.fixture(scope="module")
def location(location_model, database):
    return evaluate(location_model, database)


@pytest.fixture(scope="module")
def severity(severity_model, database):
    return evaluate(severity_model, database)


class Oracle:
    """Knows the tooth; a share of its answers it gets wrong."""

    def __init__(self, wrong=0.0):
        self.wrong = wrong

    def predict(self, X):
        return self.decision_function(X).argmax(axis=1)

    def decision_function(self, X):
        scores = np.zeros((len(X), 1 + int(X["teeth"].max())))
        wrong = np.random.default_rng(0).random(len(X)) < self.wrong
        scores[np.arange(len(X)), np.where(wrong, 0, X["tooth"])] = 10.0
        return scores

    def predict_proba(self, X):
        scores = np.exp(self.decision_function(X))
        return scores / scores.sum(axis=1, keepdims=True)

    def predict_set(self, X):
        return self.predict_proba(X) > 0.5


def asked(model, database, estimator, **options):
    return evaluate(replace(model, learner="oracle", estimators={"oracle": estimator}), database, **options)


def test_figures_that_an_estimator_has_no_answers_for_are_left_out(location):
    assert {"accuracy", "log_loss", "pd_at_1e-3", "a90"} <= set(location.figures["lda"])
    assert "log_loss" not in location.figures["fm4"]
    # 48 healthy rows resolve no rate of 1e-2, and 240 rows no calibration error.
    assert all(np.isnan(location.figures["lda"][name].value) for name in ("pd_at_1e-2", "a90", "ece"))
    titles = [row[0] for row in figure_rows(location)]
    assert "P(exact tooth)" in titles
    assert not [title for title in titles if "false alarms" in title or "ECE" in title]


def test_answers_are_asked_for_in_pieces(held_out, location_model, monkeypatch):
    estimator = location_model.estimators["lda"]
    whole = Answers.of(estimator, held_out)
    monkeypatch.setattr("sigdb.recognition.answers._AT_ONCE", 7)
    pieces = Answers.of(estimator, held_out)
    np.testing.assert_array_equal(pieces.predicted, whole.predicted)
    np.testing.assert_allclose(pieces.scores, whole.scores, rtol=1e-12)
    # Log odds of any tooth against none.
    np.testing.assert_allclose(expit(whole.detection), 1 - whole.probabilities[:, 0], rtol=1e-9, atol=1e-12)


def test_differences_are_those_of_the_figures(location, severity):
    for evaluation, name in ((location, "p_exact"), (severity, "mae_stiffness_loss")):
        ours = evaluation.figures[evaluation.learner][name].value
        assert set(evaluation.differences) == set(evaluation.figures) - {evaluation.learner}
        for other, figures in evaluation.differences.items():
            assert figures[name].value == pytest.approx(ours - evaluation.figures[other][name].value, abs=1e-12)


def test_tables_of_location(location, location_model, database):
    rows = requested_rows(location_model, database)
    confusion = location.tables["confusion"]
    assert confusion["rows"].sum() == len(rows)
    right = confusion[confusion["tooth"] == confusion["found"]]["rows"].sum() / len(rows)
    figures = location.figures[location.learner]
    assert right == pytest.approx(figures["accuracy"].value)
    against = location.tables["snr_db"].query("figure == 'p_exact' and estimator == @location.learner")
    assert against["at"].tolist() == [10.0]
    assert against["value"].tolist() == pytest.approx([figures["p_exact"].value])


def test_tables_of_severity(severity):
    levels = severity.tables["levels"].query("estimator == 'lda' and target == 'stiffness_loss' and figure == 'mae'")
    assert levels["level"].tolist() == [0.2, 0.4]
    # As many rows at each level.
    assert levels["value"].mean() == pytest.approx(severity.figures["lda"]["mae_stiffness_loss"].value)
    scatter = severity.tables["scatter"]
    assert len(scatter) == 3 * severity.rows
    assert ((scatter["low"] <= scatter["found"]) & (scatter["found"] <= scatter["high"])).all()
    assert "coverage" not in severity.tables  # no cell has 2000 rows


def test_sets_are_judged_where_an_estimator_gives_them(location_model, database):
    figures = asked(location_model, database, Oracle(0.25)).figures["oracle"]
    assert figures["set_size"].value == 1
    assert figures["set_coverage"].value == pytest.approx(figures["accuracy"].value)
    assert figures["set_coverage_healthy"].value == 1
    assert figures["set_coverage_damaged"].value == pytest.approx(figures["p_exact"].value)


def test_json_has_no_nan_and_all_figures(location, severity):
    for evaluation in (location, severity):
        read = json.loads(json.dumps(evaluation.as_json(), allow_nan=False))
        assert read["bound"] is None
        for name, figures in evaluation.figures.items():
            for figure, value in figures.items():
                expected = None if np.isnan(value.value) else value.value
                assert read["figures"][name][figure]["value"] == expected


def bound_of(rows, share):
    """A bound that is right in this share of the rows, of each specimen alike."""
    right = (np.arange(len(rows)) % 100 < 100 * share).astype(float)
    return {"accuracy": Specimens(rows["specimen"]).mean(right)}, {"accuracy": pd.Series(right, rows.index)}


@pytest.mark.parametrize("paired", [False, True])
def test_a_model_above_the_bound_fails_loudly(location_model, database, paired):
    bound, values = bound_of(requested_rows(location_model, database), 0.5)
    options = {"bound": bound} | ({"bound_values": values} if paired else {})
    evaluation = asked(location_model, database, Oracle(), **options)
    assert evaluation.above == ("accuracy",)
    with pytest.raises(EvaluationError, match=r"'oracle' is better than .* \(accuracy 1.000 .* against 0.5"):
        evaluation.check()
    assert [row[-1] for row in figure_rows(evaluation)][:2] == ["bound", str(bound["accuracy"])]


def test_who_has_seen_the_specimens_may_better_the_bound(location_model, database, monkeypatch):
    """Under S0, on other draws of the training's gears; the bound is for gears that are not known."""
    seen = usable_rows(database, "location")
    seen = seen[seen["specimen"].isin(location_model.trained_on)]
    monkeypatch.setattr("sigdb.recognition.evaluation.requested", lambda model, database: (seen, "S0, new noise only"))
    evaluation = asked(location_model, database, Oracle(), bound=bound_of(seen, 0.5)[0])
    assert evaluation.above == ()
    other = asked(replace(location_model, seed=99), database, Oracle(), bound=bound_of(seen, 0.5)[0])
    assert other.above == ("accuracy",)


@pytest.mark.parametrize("paired", [False, True])
def test_a_model_at_or_below_the_bound_passes(location_model, database, paired):
    bound, values = bound_of(requested_rows(location_model, database), 1.0)
    options = {"bound": bound} | ({"bound_values": values} if paired else {})
    for wrong in (0.0, 0.5):
        evaluation = asked(location_model, database, Oracle(wrong), **options)
        assert evaluation.above == ()
        evaluation.check()


def test_the_bound_stands_in_the_table_against_noise(location_model, database):
    rows = requested_rows(location_model, database)
    bound, values = bound_of(rows, 0.5)
    # A bound that does not cover all rows is compared on those that it covers.
    values = {"accuracy": values["accuracy"].iloc[10:]}
    table = evaluate(location_model, database, bound=bound, bound_values=values).tables["snr_db"]
    assert table.query("estimator == 'bound'")["value"].tolist() == pytest.approx([values["accuracy"].mean()])


def test_figures_that_can_be_traded_are_no_bound(location_model, database):
    # Whoever always says 'none' raises no false alarm: that is no sign of a leak.
    certain = {name: Estimate(value=0.5, low=0.5, high=0.5) for name in ("none_on_healthy", "p_detected", "p_exact")}
    rows = requested_rows(location_model, database)
    for best in (0.0, 1.0):
        values = {name: pd.Series(best, rows.index) for name in certain}
        assert asked(location_model, database, Oracle(0.5), bound=certain, bound_values=values).above == ()
    assert asked(location_model, database, Oracle(), bound=certain).above == ()


def test_less_is_better_for_losses():
    rows = pd.DataFrame({"specimen": np.arange(10)})
    ours = {name: Estimate(value=1.0, low=0.9, high=1.1) for name in ("log_loss", "mae_stiffness_loss", "accuracy")}
    less = {name: Estimate(value=0.5, low=0.4, high=0.6) for name in ours}
    assert figures_above_bound(ours, less, {}, {}, rows) == ("accuracy",)
    assert figures_above_bound(less, ours, {}, {}, rows) == ("log_loss", "mae_stiffness_loss")


@pytest.mark.parametrize("specimens", [3, 5, 60])
def test_equals_are_taken_for_better_once_in_a_hundred(specimens):
    stream, found = np.random.default_rng(7), 0
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(specimens), 300 // specimens)})
    tries = 2000
    for _ in range(tries):
        ours, best = stream.random((2, 300))
        figures = {"accuracy": Estimate(value=0.5, low=0.0, high=1.0)}
        found += bool(figures_above_bound(figures, figures, {"accuracy": ours}, {"accuracy": best}, rows))
    assert found / tries == pytest.approx(0.01, abs=4 * np.sqrt(0.01 * 0.99 / tries))


@pytest.mark.parametrize("specimens", [2, 3, 8])
@pytest.mark.parametrize("differing", [0.5, 3.0])
def test_rules_that_differ_in_single_rows_are_not_taken_for_better(specimens, differing):
    """Equally good ones: of each specimen's 100 rows so many, on average, are judged otherwise, for better or worse."""
    stream, found = np.random.default_rng(8), 0
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(specimens), 100), "tooth": 1})
    figures = {"accuracy": Estimate(value=0.5, low=0.0, high=1.0)}
    tries = 1000
    for _ in range(tries):
        gain = (stream.random(len(rows)) < differing / 100) * stream.choice([-1.0, 1.0], len(rows))
        found += bool(figures_above_bound(figures, figures, {"accuracy": gain}, {"accuracy": 0 * gain}, rows))
    assert found / tries < 0.01 + 4 * np.sqrt(0.01 * 0.99 / tries)


def test_all_figures_together_are_taken_for_better_once_in_a_hundred():
    stream, found, tries = np.random.default_rng(9), 0, 1000
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(20), 15), "tooth": 1})
    names = [f"{kind}_{i}" for kind in ("mae", "crps") for i in range(3)]
    figures = dict.fromkeys(names, Estimate(value=0.5, low=0.0, high=1.0))
    for _ in range(tries):
        ours, best = ({name: stream.random(300) for name in names} for _ in range(2))
        found += bool(figures_above_bound(figures, figures, ours, best, rows))
    assert found / tries == pytest.approx(0.01, abs=4 * np.sqrt(0.01 * 0.99 / tries))


def test_figures_without_values_tell_nothing_by_one_specimen_or_by_a_row():
    """A bootstrap over one specimen has no width, and over few hardly any."""
    ours, best = ({"pd_at_1e-2": Estimate(value=one, low=one, high=one)} for one in (0.51, 0.5))
    one, few, many = (
        pd.DataFrame({"specimen": np.arange(n) % count, "tooth": 1}) for n, count in ((200, 1), (200, 4), (10**6, 40))
    )
    assert figures_above_bound(ours, best, {}, {}, one) == ()
    assert figures_above_bound(ours, best, {}, {}, few) == ()
    assert figures_above_bound(ours, best, {}, {}, many) == ("pd_at_1e-2",)


def test_rows_that_the_bound_does_not_hold_do_not_count(location_model, database):
    """Right on all that is outside of the law, and as the bound on what is inside; of all six specimens."""
    model = replace(location_model, trained_on=())
    rows = requested_rows(model, database)
    inside = rows[rows["tooth"] % 2 == 0]
    estimator = Oracle(0.5)
    wrong = estimator.decision_function(rows).argmax(axis=1) != rows["tooth"]
    right = Specimens(inside["specimen"]).mean(1.0 - wrong[rows["tooth"] % 2 == 0])
    easy = asked(model, database, _Half(estimator), bound={"accuracy": right})
    assert easy.above == ("accuracy",)
    held = asked(model, database, _Half(estimator), bound={"accuracy": right}, bound_rows=inside.index)
    assert held.above == ()
    assert held.bound_rows == len(inside)
    assert f"answer to {len(inside)} of the rows" in bound_said(held)


class _Half(Oracle):
    """Another estimator's answers where the tooth is even, else the truth."""

    def __init__(self, other):
        super().__init__()
        self.other = other

    def decision_function(self, X):
        even = (X["tooth"] % 2 == 0).to_numpy()
        return np.where(even[:, None], self.other.decision_function(X), super().decision_function(X))
