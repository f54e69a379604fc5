"""Answers of models that are fused: one average alone, many averages, and rows that cannot be judged."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.special import logsumexp, softmax
from scipy.stats import multivariate_normal

from sigdb.core.errors import InputError, NotApplicableError
from sigdb.recognition import fuse_models
from sigdb.recognition.fusion.fused_models import _answer, credible_set
from sigdb.recognition.fusion.joint_law import AverageLaw


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


TEETH, N, SIZE = 4, 24, 2.0
LOSSES = np.array([0.0, 0.1, 0.25, 0.4])


class ContinuousLaws:
    """Laws of a bank that holds between its severities: signals linear in the loss, and a response to index errors."""

    def __init__(self, seed):
        stream = np.random.default_rng(seed)
        self.change, each = stream.standard_normal(N), stream.standard_normal(N // TEETH)
        self.response = np.stack([np.roll(np.pad(each, (0, N - len(each))), i * len(each)) for i in range(TEETH)], 1)

    def at(self, *point):
        return AverageLaw(
            teeth=TEETH,
            keys=tuple((loss,) for loss in LOSSES),
            healthy=LOSSES == 0,
            severity=np.column_stack([LOSSES, 0 * LOSSES, LOSSES > 0]),
            signal=8 * LOSSES[:, None] * self.change,
            response=np.repeat(self.response[None], len(LOSSES), axis=0),
            harmonic=np.zeros((len(LOSSES), N, 0)),
            phases=np.zeros((len(LOSSES), 0, TEETH)),
        )

    def share(self, teeth, keys):
        return np.where(LOSSES > 0, 1 / 3, 1.0)

    def has_continuous_severity(self, teeth):
        return True


def test_several_averages_take_any_severity_between_those_of_the_templates():
    """Odds and loss are those of the normal density of both averages together, integrated over the loss."""
    laws, noise = [ContinuousLaws(1), ContinuousLaws(2)], np.array([0.8, 1.2])
    stream = np.random.default_rng(3)
    response = np.vstack([law.response for law in laws])
    covariance = np.diag(np.repeat(noise**2, N)) + SIZE**2 * response @ response.T
    change = np.concatenate([8 * np.roll(law.change, 2 * N // TEETH) for law in laws])  # at the third tooth
    x = 0.17 * change + np.linalg.cholesky(covariance) @ stream.standard_normal(2 * N)
    rows = pd.DataFrame(
        {"teeth": TEETH, "speed_rpm": 1.0, "torque": 1.0, "noise": noise, "part": [0, 1], "reason": ""}
    ).assign(tsa=[x[:N], x[N:]])
    answer = _answer(rows, laws, [SIZE, SIZE])
    at = np.linspace(0, 0.4, 2001)
    changes = [np.concatenate([8 * np.roll(law.change, t * N // TEETH) for law in laws]) for t in range(TEETH)]
    density = np.array([multivariate_normal.logpdf(x - at[:, None] * each, cov=covariance) for each in changes])
    none = multivariate_normal.logpdf(x, cov=covariance)
    assert_allclose(answer["log_odds"], logsumexp(density) - np.log(len(at) * TEETH) - none, atol=0.02)
    assert answer["tooth"] == 3
    of_loss = np.cumsum(softmax(logsumexp(density, axis=0)))
    for end, p in (("_low", 0.05), ("", 0.5), ("_high", 0.95)):
        assert_allclose(answer[f"stiffness_loss{end}"], at[np.searchsorted(of_loss, p)], atol=0.006)


def test_a_credible_set_holds_the_most_probable_answers():
    assert credible_set(np.array([0.5, 0.3, 0.15, 0.05])) == (0, 1, 2)
    assert credible_set(np.array([0.02, 0.03, 0.95])) == (2,)
