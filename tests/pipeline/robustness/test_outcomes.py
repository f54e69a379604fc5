"""Unit: an answer is right where it names what is true: the tooth, whether there is damage, or the kind of damage."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from sigdb.pipeline.robustness.outcomes import AlarmThresholds, Robustness
from sigdb.recognition import Answers

ROWS = pd.DataFrame({"tooth": [0, 3, 2, 2], "kind": ["none", "pit", "crack", "crack"]})
KINDS = ("none", "crack", "pit")


@pytest.mark.parametrize(
    ("target", "predicted", "classes"),
    [("location", [0, 3, 1, 2], ()), ("detection", [0, 1, 0, 1], ()), ("kind", [0, 2, 0, 1], KINDS)],
)
def test_answers_are_right_where_they_name_what_is_true(target, predicted, classes):
    answers = Answers(predicted=np.array(predicted), classes=classes)
    robustness = Robustness(model=SimpleNamespace(target=target), thresholds={})
    right, sure = robustness._right_and_sure(ROWS, answers)
    assert right.tolist() == [True, True, False, True]
    assert sure.all()


def test_a_set_of_one_kind_is_sure():
    sets = np.array([[True, False, False], [True, False, True], [False, False, True], [False, True, False]])
    answers = Answers(predicted=np.array([0, 2, 2, 1]), sets=sets, classes=KINDS)
    robustness = Robustness(model=SimpleNamespace(target="kind"), thresholds={})
    right, sure = robustness._right_and_sure(ROWS, answers)
    assert sure.tolist() == [True, False, True, True]
    assert right.tolist() == [True, True, False, True]


def test_alarms_have_their_rate_in_each_band_of_noise():
    stream = np.random.default_rng(3)
    noise = np.repeat([-20.0, -10.0], 20_000)
    spread = np.where(noise > -15, 1.0, 5.0)
    thresholds = AlarmThresholds.of(spread * stream.standard_normal(40_000), noise, 0.01)
    alarms = thresholds.alarms(spread * stream.standard_normal(40_000), noise)
    for band in (-20.0, -10.0):
        assert abs(alarms[noise == band].mean() - 0.01) < 5 * np.sqrt(2 * 0.01 / 20_000)
    assert AlarmThresholds.of(np.zeros(99), np.zeros(99), 0.01) is None
