"""Unit: a model that is as good as the bound is taken for better once in a hundred evaluations."""

import numpy as np
import pandas as pd
import pytest

from sigdb.recognition import TARGETS, Estimate
from sigdb.recognition.metrics.metric import Metric
from sigdb.recognition.metrics.significance import metrics_above_bound

ALL = list({metric.name: metric for target in TARGETS.values() for metric in target.metrics}.values())


def above(model, bound, model_values, bound_values, rows, metrics=ALL):
    return metrics_above_bound(metrics, model, bound, model_values, bound_values, rows)


def test_less_is_better_for_losses():
    rows = pd.DataFrame({"specimen": np.arange(10)})
    ours = {name: Estimate(value=1.0, low=0.9, high=1.1) for name in ("log_loss", "mae_stiffness_loss", "accuracy")}
    less = {name: Estimate(value=0.5, low=0.4, high=0.6) for name in ours}
    assert above(ours, less, {}, {}, rows) == ("accuracy",)
    assert above(less, ours, {}, {}, rows) == ("log_loss", "mae_stiffness_loss")


@pytest.mark.parametrize("specimens", [3, 5, 60])
def test_equals_are_taken_for_better_once_in_a_hundred(specimens):
    stream, found = np.random.default_rng(7), 0
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(specimens), 300 // specimens)})
    tries = 2000
    for _ in range(tries):
        ours, best = stream.random((2, 300))
        estimates = {"accuracy": Estimate(value=0.5, low=0.0, high=1.0)}
        found += bool(above(estimates, estimates, {"accuracy": ours}, {"accuracy": best}, rows))
    assert found / tries == pytest.approx(0.01, abs=4 * np.sqrt(0.01 * 0.99 / tries))


@pytest.mark.parametrize("specimens", [2, 3, 8])
@pytest.mark.parametrize("differing", [0.5, 3.0])
def test_rules_that_differ_in_single_rows_are_not_taken_for_better(specimens, differing):
    """Equally good ones: of each specimen's 100 rows so many, on average, are judged otherwise, for better or worse."""
    stream, found = np.random.default_rng(8), 0
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(specimens), 100), "tooth": 1})
    estimates = {"accuracy": Estimate(value=0.5, low=0.0, high=1.0)}
    tries = 1000
    for _ in range(tries):
        gain = (stream.random(len(rows)) < differing / 100) * stream.choice([-1.0, 1.0], len(rows))
        found += bool(above(estimates, estimates, {"accuracy": gain}, {"accuracy": 0 * gain}, rows))
    assert found / tries < 0.01 + 4 * np.sqrt(0.01 * 0.99 / tries)


def test_all_metrics_together_are_taken_for_better_once_in_a_hundred():
    stream, found, tries = np.random.default_rng(9), 0, 1000
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(20), 15), "tooth": 1})
    names = [f"metric_{i}" for i in range(6)]
    metrics = [Metric(name=name, title=name, better=-1, bounded=True) for name in names]
    estimates = dict.fromkeys(names, Estimate(value=0.5, low=0.0, high=1.0))
    for _ in range(tries):
        ours, best = ({name: stream.random(300) for name in names} for _ in range(2))
        found += bool(above(estimates, estimates, ours, best, rows, metrics))
    assert found / tries == pytest.approx(0.01, abs=4 * np.sqrt(0.01 * 0.99 / tries))


def test_what_is_bounded_is_a_field_of_the_metric_whatever_its_name():
    """The beginnings of the names decided before, and which of two values is better."""
    rows = pd.DataFrame({"specimen": np.repeat(np.arange(20), 15), "tooth": 1})
    few, many = np.zeros(300), np.ones(300)
    few[:30], many[:30] = 1.0, 0.0
    estimates = dict.fromkeys(("quality", "loss", "accuracy_of_another"), Estimate(value=0.5, low=0.4, high=0.6))
    metrics = [
        Metric(name="quality", title="quality", better=1, bounded=True),
        Metric(name="loss", title="loss", better=-1, bounded=True),
        Metric(name="accuracy_of_another", title="accuracy", better=1, bounded=False),
    ]
    ours = {"quality": many, "loss": few, "accuracy_of_another": many}
    best = {"quality": few, "loss": many, "accuracy_of_another": few}
    assert above(estimates, estimates, ours, best, rows, metrics) == ("loss", "quality")
    assert above(estimates, estimates, best, ours, rows, metrics) == ()


def test_metrics_without_values_tell_nothing_by_one_specimen_or_by_a_row():
    """A bootstrap over one specimen has no width, and over few hardly any."""
    ours, best = ({"pd_at_1e-2": Estimate(value=one, low=one, high=one)} for one in (0.51, 0.5))
    one, few, many = (
        pd.DataFrame({"specimen": np.arange(n) % count, "tooth": 1}) for n, count in ((200, 1), (200, 4), (10**6, 40))
    )
    assert above(ours, best, {}, {}, one) == ()
    assert above(ours, best, {}, {}, few) == ()
    assert above(ours, best, {}, {}, many) == ("pd_at_1e-2",)
