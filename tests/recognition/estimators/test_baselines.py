"""Unit: the baselines do what they say, and the models beat them."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.database import QUANTITIES
from sigdb.recognition import TemplateScores, evaluate
from sigdb.recognition.estimators.baselines.threshold import (
    EnvelopeLocation,
    Fm4Location,
    Fm4Severity,
    MajorityLocation,
    MajoritySeverity,
    Na4StarLocation,
)
from sigdb.signature import na4_star, residual_signal


@pytest.mark.parametrize("healthy", [101, 500, 3000])
def test_fm4_threshold_has_its_false_alarm_rate(healthy):
    stream = np.random.default_rng(healthy)
    fm4 = np.concatenate([stream.normal(3, 0.3, healthy), stream.normal(6, 2, 200)])
    y = np.repeat([0, 4], [healthy, 200])
    baseline = Fm4Location().fit(pd.DataFrame({"fm4": fm4}), y)
    called = baseline.predict(pd.DataFrame({"fm4": fm4})) > 0
    assert called[:healthy].mean() == pytest.approx(0.01, abs=1 / healthy)
    assert_array_equal(called, fm4 > np.sort(fm4[:healthy])[-1 - healthy // 100])


def test_fm4_names_the_most_frequent_tooth():
    X = pd.DataFrame({"fm4": [3.0, 3.1, 2.9, 5.0, 6.0, 7.0]})
    baseline = Fm4Location().fit(X, [0, 0, 0, 9, 2, 9])
    assert baseline.predict(X).tolist() == [0, 9, 0, 9, 9, 9]
    assert baseline.classes_.tolist() == [0, 2, 9]


def test_majority_says_what_was_most_frequent():
    X = pd.DataFrame({"fm4": np.arange(6.0)})
    assert MajorityLocation().fit(X, [5, 5, 5, 0, 0, 3]).predict(X[:2]).tolist() == [5, 5]
    y = pd.DataFrame(
        {
            "tooth": [0, 0, 0, 3, 4, 5],
            "stiffness_loss": [0.9, 0.9, 0.9, 0.1, 0.2, 0.5],
            "phase_shift_deg": [9.0, 9.0, 9.0, -1.0, 0.0, 3.0],
            "damaged_teeth": [0, 0, 0, 1, 1, 3],
        }
    )
    found = MajoritySeverity().fit(X, y).predict(X[:2])
    assert list(found) == list(QUANTITIES)
    assert_array_equal(found.to_numpy(), [[0.2, 0.0, 1.0]] * 2)


def test_fm4_severity_is_the_best_monotonic_function():
    fm4 = np.array([3.0, 4.0, 5.0, 6.0, 7.0])
    y = pd.DataFrame(
        {
            "tooth": [1] * 5,
            # Pooling adjacent violators: 0.3 and 0.2 become 0.25; the falling target is fitted falling.
            "stiffness_loss": [0.1, 0.3, 0.2, 0.4, 0.5],
            "phase_shift_deg": [5.0, 4.0, 3.0, 2.0, 1.0],
            "damaged_teeth": [1, 1, 2, 2, 3],
        }
    )
    healthy = y.assign(tooth=0, stiffness_loss=99.0, phase_shift_deg=99.0, damaged_teeth=99)
    X = pd.DataFrame({"fm4": np.concatenate([fm4, fm4])})
    baseline = Fm4Severity().fit(X, pd.concat([y, healthy], ignore_index=True))
    found = baseline.predict(pd.DataFrame({"fm4": [3.0, 4.0, 5.0, 6.0, 7.0, 0.0, 99.0]}))
    assert_allclose(found["stiffness_loss"], [0.1, 0.25, 0.25, 0.4, 0.5, 0.1, 0.5])
    assert_allclose(found["phase_shift_deg"], [5, 4, 3, 2, 1, 5, 1])
    assert_allclose(found["damaged_teeth"], [1, 1, 2, 2, 3, 1, 3])


def test_fm4_severity_of_a_target_that_does_not_vary_is_that_target():
    X = pd.DataFrame({"fm4": [3.0, 4.0, 5.0, 6.0, 7.0]})
    y = pd.DataFrame(
        {"tooth": 1, "stiffness_loss": [0.1, 0.2, 0.3, 0.4, 0.5], "phase_shift_deg": 0.0, "damaged_teeth": 1}
    )
    found = Fm4Severity().fit(X, y).predict(X)
    assert_allclose(found.to_numpy(), np.column_stack([y["stiffness_loss"], np.zeros(5), np.ones(5)]))


def test_models_beat_the_baselines_on_specimens_that_they_have_not_seen(database, location_model, severity_model):
    location = evaluate(location_model, database, bound=False).metrics
    baselines = {"whitened_bank", "nearest_template", "envelope_peak", "na4_star", "fm4", "majority"}
    assert set(location) == {"lda", "boosting", "templates", *baselines}
    for learner in ("lda", "boosting"):
        assert location[learner]["p_exact"].value > 0.5
        assert location[learner]["none_on_healthy"].value > 0.9
        assert abs(location[learner]["circular_bias"].value) < 0.5
    assert location["fm4"]["p_exact"].value < 0.2
    assert location["majority"]["p_exact"].value < 0.2
    severity = evaluate(severity_model, database, bound=False).metrics
    for learner in ("lda", "boosting"):
        assert severity[learner]["mae_stiffness_loss"].value < 0.5 * severity["fm4"]["mae_stiffness_loss"].value
        assert severity[learner]["mae_damaged_teeth"].value < 0.5 * severity["majority"]["mae_damaged_teeth"].value
        assert severity[learner]["coverage_stiffness_loss"].value > 0.7
    assert "coverage_stiffness_loss" not in severity["fm4"]


@pytest.mark.parametrize("learner", ["lda", "boosting"])
def test_probabilities_are_calibrated_better_than_a_guess(location_model, held_out, learner):
    probability = location_model.estimators[learner].predict_proba(held_out)
    assert_allclose(probability.sum(axis=1), 1, rtol=0, atol=1e-12)
    assert (probability >= 0).all()
    y = held_out["tooth"].to_numpy()
    log_loss = -np.log(probability[np.arange(len(y)), y]).mean()
    prior = np.bincount(y) / len(y)
    assert log_loss < 0.2 * -(prior * np.log(prior)).sum()
    # Held back in step: what is said with probability p comes true about as often.
    assert abs(probability.max(axis=1).mean() - (probability.argmax(axis=1) == y).mean()) < 0.05


def test_intervals_from_fewer_than_nine_specimens_are_the_whole_range(severity_model, held_out):
    ranges = {"stiffness_loss": (0.2, 0.4), "phase_shift_deg": (0.0, 2.0), "damaged_teeth": (1.0, 2.0)}
    for learner in ("lda", "boosting"):
        found = severity_model.estimators[learner].predict(held_out)
        for target, (low, high) in ranges.items():
            assert_allclose(found[f"{target}_low"], np.minimum(low, found[target]), rtol=1e-12)
            assert_allclose(found[f"{target}_high"], np.maximum(high, found[target]), rtol=1e-12)
        assert found["stiffness_loss"].between(0, 1).all()
        assert (found["damaged_teeth"] >= 1).all()


def averages(teeth=6, step=16, rows=40, noise=0.1, seed=0):
    """Averages of a mesh of constant amplitude with noise, all healthy."""
    stream, n = np.random.default_rng(seed), teeth * step
    x = np.cos(2 * np.pi * teeth * np.arange(n) / n) + noise * stream.normal(size=(rows, n))
    return pd.DataFrame({"teeth": teeth, "speed_rpm": 1000.0, "torque": 10.0, "tsa": list(x)})


def test_na4_star_is_that_of_a_history_with_the_healthy_rows_first():
    healthy, asked = averages(rows=200), averages(rows=5, noise=0.3, seed=1)
    baseline = Na4StarLocation().fit(pd.concat([healthy, asked]), np.repeat([0, 3], [200, 5]))
    residuals = residual_signal(np.stack([*healthy["tsa"], *asked["tsa"]]), teeth=6)
    assert_allclose(baseline.indicator(asked), na4_star(residuals, baseline=200)[200:], rtol=1e-9)
    assert baseline.predict(asked).tolist() == [3] * 5


def test_na4_star_takes_the_healthy_rows_of_the_operating_point():
    quiet, loud = averages(rows=100), averages(rows=100, noise=1.0).assign(speed_rpm=2000.0)
    damaged = averages(rows=1).assign(speed_rpm=1500.0)
    baseline = Na4StarLocation().fit(pd.concat([quiet, loud, damaged]), np.repeat([0, 1], [200, 1]))
    # Of Gaussian noise 3, at its own level, also a few per cent off the point.
    assert baseline.indicator(loud.assign(speed_rpm=2040.0)).mean() == pytest.approx(3, rel=0.2)
    assert baseline.indicator(quiet).mean() == pytest.approx(3, rel=0.2)


def test_the_envelope_s_peak_names_the_tooth():
    healthy = averages(rows=200)
    tooth = np.arange(1, 7)
    damaged = averages(rows=6, seed=2)
    burst = np.hanning(16) * np.cos(2 * np.pi * 4.5 * np.arange(16) / 16)
    damaged["tsa"] = [
        x + np.pad(burst, ((t - 1) * 16, (6 - t) * 16)) for x, t in zip(damaged["tsa"], tooth, strict=True)
    ]
    baseline = EnvelopeLocation().fit(pd.concat([healthy, damaged]), np.concatenate([np.zeros(200, int), tooth]))
    assert_array_equal(baseline.predict(damaged), tooth)
    assert (baseline.predict(averages(rows=1000, seed=3)) > 0).mean() == pytest.approx(0.01, abs=0.02)


def test_the_nearest_template_is_that_of_all_turns(database, rows, location_model):
    baseline = location_model.estimators["nearest_template"]
    some = rows.iloc[::40]
    point = baseline.bank.points[0].hypotheses
    x, step = np.stack(some["tsa"].to_list()).astype(float), some["tsa"].iloc[0].size // 12
    turned = np.stack([np.roll(point.signal, t * step, axis=1) for t in range(12)], axis=1)
    distance = np.linalg.norm(x[:, None, None] - turned, axis=-1)
    damage, none = distance[:, ~point.healthy], distance[:, point.healthy].min(axis=(1, 2))
    assert_array_equal(baseline.tooth(some), 1 + damage.min(axis=1).argmin(axis=1))
    nearer = (none - damage.min(axis=(1, 2))) / np.linalg.norm(x, axis=1)
    assert_allclose(baseline.indicator(some), nearer, rtol=0, atol=1e-6)


def test_the_whitened_bank_takes_likelihoods_as_they_are(rows, location_model):
    baseline = location_model.estimators["whitened_bank"]
    some = rows.iloc[::40]
    ratio = TemplateScores(baseline.bank).transform(some)[:, :12]
    assert_array_equal(baseline.predict(some), np.where(ratio.max(axis=1) > 0, 1 + ratio.argmax(axis=1), 0))
