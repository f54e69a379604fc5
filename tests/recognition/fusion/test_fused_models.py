"""Answers of models that are fused: one average alone, many averages, and rows that cannot be judged."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import logsumexp

from sigdb.core.errors import InputError, NotApplicableError
from sigdb.recognition import fuse_models
from sigdb.recognition.fusion.fused_models import credible_set


@pytest.fixture(scope="module")
def some(held_out):
    damaged = held_out[held_out["tooth"] > 0].iloc[::9].head(6)
    return damaged.assign(machine=np.arange(len(damaged)))


def test_one_average_alone_has_the_odds_of_the_templates(location_model, some):
    answers = fuse_models([(location_model, some)])
    scores = location_model.estimators["whitened_bank"].decision_function(some)
    inside = ~answers["outside"].to_numpy()
    assert inside.sum() > 3
    assert_allclose(answers["log_odds"][inside], logsumexp(scores[inside, 1:], axis=1), rtol=1e-3, atol=0.02)
    assert answers["tooth"][inside].tolist() == some["tooth"][inside].tolist()
    assert (answers.loc[inside, "kind"] == "one tooth").all()


def test_averages_of_one_machine_have_one_answer(location_model, held_out):
    rows = held_out[held_out["tooth"] == 3]
    rows = rows.assign(machine=rows["stiffness_loss"].map({0.2: "a", 0.4: "b"}))
    rows = rows[(rows["phase_shift_deg"] == 0) & (rows["damaged_teeth"] == 1)]
    answers = fuse_models([(location_model, rows), (location_model, rows)])
    assert answers["averages"].to_dict() == {
        "a": 2 * (rows["machine"] == "a").sum(),
        "b": 2 * (rows["machine"] == "b").sum(),
    }
    assert answers["tooth"].tolist() == [3, 3]
    assert answers["stiffness_loss"].to_dict() == {"a": 0.2, "b": 0.4}


def test_a_machine_with_a_row_outside_the_training_is_not_judged(location_model, some):
    answers = fuse_models([(location_model, some.assign(speed_rpm=np.where(some["machine"] == 1, 9000.0, 14400.0)))])
    assert answers.loc[1, "kind"] == "cannot be judged"
    assert answers.loc[1, "reason"].startswith("speed_rpm = 9000")
    assert answers.loc[1, "candidates"] == ()


def test_models_and_rows_that_cannot_be_fused_are_refused(location_model, some):
    with pytest.raises(InputError, match="the rows lack the columns serial; give averages with their machines"):
        fuse_models([(location_model, some)], machine="serial")
    bare = replace(location_model, learner="fm4", estimators={"fm4": location_model.estimators["fm4"]})
    with pytest.raises(NotApplicableError, match="has no templates, whose law joins averages"):
        fuse_models([(bare, some)])


def test_a_credible_set_holds_the_most_probable_answers():
    assert credible_set(np.array([0.5, 0.3, 0.15, 0.05])) == (0, 1, 2)
    assert credible_set(np.array([0.02, 0.03, 0.95])) == (2,)
