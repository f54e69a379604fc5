"""Unit: metrics of location and severity on arrays worked out by hand, and their intervals."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.location_and_severity import (
    LOCATION_METRICS,
    SEVERITY_METRICS,
    circular_distance,
    location_values,
    severity_values,
)
from sigdb.recognition.metrics.metric import estimates


def location_metrics(predicted, rows, seed=0):
    return estimates(LOCATION_METRICS, location_values(predicted, rows), Specimens(rows["specimen"], seed=seed))


def severity_metrics(predicted, rows):
    return estimates(SEVERITY_METRICS, severity_values(predicted, rows), Specimens(rows["specimen"]))


@given(st.integers(1, 40), st.data())
def test_circular_distance_is_the_shortest_of_all_ways_around(teeth, data):
    found, true = (data.draw(st.integers(1, teeth)) for _ in range(2))
    ways = [found - true + k * teeth for k in (-1, 0, 1)]
    shortest = min(abs(way) for way in ways)
    distance = int(circular_distance(np.array([found]), np.array([true]), np.array([teeth]))[0])
    assert distance in [way for way in ways if abs(way) == shortest]


def located(true, found, teeth=12, specimen=None):
    rows = pd.DataFrame({"tooth": true, "teeth": teeth, "specimen": range(len(true)) if specimen is None else specimen})
    return {name: metric.value for name, metric in location_metrics(np.array(found), rows).items()}


def test_location_metrics_by_hand():
    # exact, one on, one back over the tacho mark, one on over it, three off, missed, missed; healthy: right, wrong
    true = [4, 4, 1, 12, 6, 1, 12, 0, 0]
    found = [4, 5, 12, 1, 9, 0, 0, 0, 3]
    values = located(true, found)
    assert values["accuracy"] == pytest.approx(2 / 9)
    assert values["p_exact"] == pytest.approx(1 / 7)
    assert values["p_within_one"] == pytest.approx(4 / 7)
    assert values["p_detected"] == pytest.approx(5 / 7)
    assert values["none_on_healthy"] == pytest.approx(1 / 2)
    assert values["circular_bias"] == pytest.approx((0 + 1 - 1 + 1 + 3) / 5)


def test_teeth_next_to_the_tacho_mark_are_not_next_to_none():
    values = located([1, 1, 12], [0, 2, 0])
    assert (values["p_exact"], values["p_within_one"]) == (0, pytest.approx(1 / 3))
    assert np.isnan(values["none_on_healthy"])


def test_each_row_counts_with_its_own_number_of_teeth():
    values = located([1, 1], [12, 12], teeth=[12, 36])
    assert values["p_within_one"] == pytest.approx(1 / 2)
    assert values["circular_bias"] == pytest.approx((-1 + 11) / 2)


def test_metrics_without_rows_are_nan_and_print_as_a_dash():
    rows = pd.DataFrame({"tooth": [0, 0], "teeth": 12, "specimen": [0, 1]})
    metrics = location_metrics(np.array([0, 0]), rows)
    assert {name for name, metric in metrics.items() if np.isnan(metric.value)} == {
        "p_exact",
        "p_within_one",
        "p_detected",
        "circular_bias",
    }
    assert str(metrics["p_exact"]) == "-"
    assert str(metrics["none_on_healthy"]) == "1.000 [0.342, 1.000]"  # Wilson, 2 of 2
    assert str(Estimate(value=0.12345, low=0.1, high=2.0)) == "0.123 [0.100, 2.000]"


def answers(loss, half_width, **others):
    columns = {"stiffness_loss": loss, "phase_shift_deg": [0.0] * len(loss), "damaged_teeth": [1.0] * len(loss)}
    found = pd.DataFrame(columns | others)
    found["stiffness_loss_low"] = found["stiffness_loss"] - half_width
    found["stiffness_loss_high"] = found["stiffness_loss"] + half_width
    return found


def test_severity_metrics_by_hand():
    rows = pd.DataFrame(
        {
            "stiffness_loss": [0.25, 0.5, 0.75, 0.0],
            "phase_shift_deg": [0.0, 1.5, -3.0, 0.0],
            "damaged_teeth": [1, 2, 3, 1],
            "specimen": [0, 0, 1, 2],
        }
    )
    # Errors 0.125, 0.25, 0.0625, 0: three are inside of half a width of 0.125, one of them at its end.
    metrics = severity_metrics(answers([0.375, 0.25, 0.6875, 0.0], 0.125), rows)
    values = {name: metric.value for name, metric in metrics.items()}
    interval_scores = [(e / 2 + 0.05 * (0.25 + 20 * max(0, e - 0.125))) / 1.5 for e in (0.125, 0.25, 0.0625, 0)]
    assert values == pytest.approx(
        {
            "mae_stiffness_loss": (0.125 + 0.25 + 0.0625 + 0) / 4,
            "rmse_stiffness_loss": ((0.125**2 + 0.25**2 + 0.0625**2) / 4) ** 0.5,
            "bias_stiffness_loss": (0.125 - 0.25 - 0.0625 + 0) / 4,
            "crps_stiffness_loss": sum(interval_scores) / 4,
            "coverage_stiffness_loss": 3 / 4,
            "mae_phase_shift_deg": (0 + 1.5 + 3 + 0) / 4,
            "rmse_phase_shift_deg": ((1.5**2 + 3**2) / 4) ** 0.5,
            "bias_phase_shift_deg": (-1.5 + 3) / 4,
            "crps_phase_shift_deg": (0 + 1.5 + 3 + 0) / 4,
            "mae_damaged_teeth": (0 + 1 + 2 + 0) / 4,
            "rmse_damaged_teeth": ((1 + 4) / 4) ** 0.5,
            "bias_damaged_teeth": -(1 + 2) / 4,
            "crps_damaged_teeth": (0 + 1 + 2 + 0) / 4,
        }
    )


def test_one_specimen_has_no_interval():
    stream = np.random.default_rng(0)
    rows = pd.DataFrame({"tooth": 5, "teeth": 12, "specimen": 7}, index=range(50))
    metric = location_metrics(stream.integers(4, 7, 50), rows)["p_exact"]
    assert np.isnan([metric.low, metric.high]).all()
    assert 0 < metric.value < 1


def test_two_specimens_that_disagree_span_the_interval():
    # Student's t with one degree of freedom goes far beyond shares of 0 and 1.
    rows = pd.DataFrame({"tooth": 5, "teeth": 12, "specimen": np.repeat([3, 9], 20)})
    metric = location_metrics(np.repeat([5, 6], 20), rows)["p_exact"]
    assert (metric.low, metric.value, metric.high) == (0, 0.5, 1)


def test_the_interval_of_many_specimens_is_that_of_their_mean():
    specimens, per_specimen = 400, 5
    level = np.random.default_rng(1).standard_normal(specimens)
    loss = np.repeat(level, per_specimen)
    rows = pd.DataFrame(
        {
            "stiffness_loss": loss - np.abs(loss),
            "phase_shift_deg": 0.0,
            "damaged_teeth": 1,
            "specimen": np.repeat(np.arange(specimens), per_specimen),
        }
    )
    metric = severity_metrics(answers(loss, 0.1), rows)["mae_stiffness_loss"]
    mean, error = np.abs(level).mean(), np.abs(level).std() / np.sqrt(specimens)
    assert metric.value == pytest.approx(mean)
    # Rows of a specimen are no new evidence: counted one by one they would give less than half this width.
    assert metric.high - metric.low == pytest.approx(2 * 1.96 * error, rel=0.1)
    assert metric.low < mean < metric.high


@given(st.integers(2, 8), st.integers(0, 10**6))
def test_the_interval_holds_the_mean(specimens, seed):
    stream = np.random.default_rng(seed)
    rows = pd.DataFrame({"tooth": 5, "teeth": 12, "specimen": stream.integers(0, specimens, 80)})
    metrics = location_metrics(stream.integers(4, 8, 80), rows)
    for name in ("p_exact", "p_within_one", "circular_bias"):
        assert metrics[name].low <= metrics[name].value + 1e-12
        assert metrics[name].high >= metrics[name].value - 1e-12


def test_the_interval_is_the_same_each_time_and_moves_with_the_seed():
    rows = pd.DataFrame({"tooth": 5, "teeth": 12, "specimen": np.arange(60)})
    found = np.random.default_rng(3).integers(4, 7, 60)
    metrics = [location_metrics(found, rows, seed=seed)["circular_bias"] for seed in (0, 0, 1, 2, 3)]
    assert metrics[0] == metrics[1]
    assert len({(one.low, one.high) for one in metrics}) > 1
