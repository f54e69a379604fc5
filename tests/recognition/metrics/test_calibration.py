"""Unit: calibration, coverage and CRPS against scikit-learn, numerical integrals and hand-counted bins."""

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import quad
from scipy.stats import norm
from sklearn.metrics import log_loss

from sigdb.recognition.metrics import calibration as metrics_calibration
from sigdb.recognition.metrics.calibration import (
    CALIBRATION_METRICS,
    calibration_error,
    calibration_values,
    reliability,
)
from sigdb.recognition.metrics.coverage import SET_METRICS, coverage_cells, set_values, value_bands
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.metrics.location_and_severity import crps_quantiles, crps_sample
from sigdb.recognition.metrics.metric import estimates


def error_of(p, rows):
    return calibration_error(p, rows["tooth"].to_numpy(), Specimens(rows["specimen"]))


def drawn(rows, *, seed=0, sharper=1.0):
    """Probabilities of three classes and labels drawn by them; sharper ones claim more than they know."""
    stream = np.random.default_rng(seed)
    scores = stream.normal(0, 1.5, (rows, 3))
    p, claimed = (np.exp(k * scores) / np.exp(k * scores).sum(axis=1, keepdims=True) for k in (1.0, sharper))
    tooth = (stream.random(rows)[:, None] > p.cumsum(axis=1)).sum(axis=1)
    return claimed, pd.DataFrame({"tooth": tooth, "specimen": np.arange(rows) % 30})


def test_log_loss_and_brier_score():
    p, rows = drawn(500)
    metrics = estimates(
        CALIBRATION_METRICS, calibration_values(p, rows["tooth"].to_numpy()), Specimens(rows["specimen"])
    )
    assert metrics["log_loss"].value == pytest.approx(log_loss(rows["tooth"], p), rel=1e-12)
    expected = ((p - np.eye(3)[rows["tooth"]]) ** 2).sum(axis=1).mean()
    assert metrics["brier"].value == pytest.approx(expected, rel=1e-12)
    assert np.isnan(error_of(p, rows).value)


def test_calibration_error_by_hand(monkeypatch):
    monkeypatch.setattr(metrics_calibration, "ENOUGH", 5)
    p = np.array([[0.62, 0.38], [0.66, 0.34], [0.1, 0.9], [0.05, 0.95], [0.0, 1.0]])
    rows = pd.DataFrame({"tooth": [0, 1, 1, 0, 1], "specimen": range(5)})
    # Bin 0.6: one of two right, 0.64 said. Bin 0.9, 1 included: two of three right, 0.95 said.
    expected = (2 * abs(0.5 - 0.64) + 3 * abs(2 / 3 - 0.95)) / 5
    assert error_of(p, rows).value == pytest.approx(expected, rel=1e-12)
    table = reliability(p, rows["tooth"].to_numpy(), Specimens(rows["specimen"]))
    np.testing.assert_allclose(table[["probability", "right", "rows"]], [[0.64, 0.5, 2], [0.95, 2 / 3, 3]], rtol=1e-12)


def test_calibration_error_tells_honest_from_overconfident_probabilities():
    honest, rows = drawn(20_000)
    assert error_of(honest, rows).value < 0.01
    claimed, rows = drawn(20_000, sharper=2.0)
    error = error_of(claimed, rows)
    assert error.value > 0.05
    assert error.low < error.value < error.high


def test_crps_of_a_sample_is_the_integral_of_its_definition():
    stream = np.random.default_rng(1)
    for _ in range(5):
        x, w, y = stream.normal(size=6), stream.random(6), stream.normal()
        ends = np.sort(np.append(x, y))
        F = [w[x <= middle].sum() / w.sum() - (middle >= y) for middle in (ends[1:] + ends[:-1]) / 2]
        assert crps_sample(x, y, w) == pytest.approx((np.square(F) * np.diff(ends)).sum(), rel=1e-12)


def test_crps_of_a_large_sample_and_of_dense_quantiles_is_that_of_the_normal_law():
    """sigma (z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi)), z = (y - mu) / sigma: Gneiting and Raftery (2007), sec. 4."""
    y, z = 1.7, (1.7 - 0.5) / 2
    expected = 2 * (z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi))
    integral = quad(lambda x: (norm.cdf((x - 0.5) / 2) - (x >= y)) ** 2, -20, 20, points=[y])[0]
    assert expected == pytest.approx(integral, rel=1e-6)
    levels = (np.arange(4000) + 0.5) / 4000
    quantiles = norm.ppf(levels, 0.5, 2)
    assert crps_sample(quantiles, y) == pytest.approx(expected, rel=1e-3)
    assert crps_quantiles(quantiles, levels, y) == pytest.approx(expected, rel=1e-3)


def test_crps_of_three_quantiles_is_the_weighted_interval_score():
    # (|y - m| / 2 + alpha / 2 ((u - l) + 2 / alpha (l - y or y - u))) / 1.5, alpha = 0.1; Bracher et al. (2021), eq. 3.
    low, middle, high, alpha = 1.0, 2.0, 4.0, 0.1
    for y, outside in ((2.5, 0.0), (0.5, 0.5), (6.0, 2.0)):
        expected = (abs(y - middle) / 2 + alpha / 2 * (high - low + 2 / alpha * outside)) / 1.5
        assert crps_quantiles([low, middle, high], [0.05, 0.5, 0.95], y) == pytest.approx(expected, rel=1e-12)


def test_coverage_of_cells_that_have_enough_rows():
    stream = np.random.default_rng(2)
    rows = pd.DataFrame(
        {
            "stiffness_loss": stream.choice([0.1, 0.2, 0.4], 9000, p=[0.5, 0.45, 0.05]),
            "snr_db": stream.choice([-10.0, 0.0], 9000),
            "speed_rpm": 1000.0,
            "torque": 5.0,
            "specimen": np.arange(9000) % 40,
        }
    )
    inside = (stream.random(9000) < np.where(rows["stiffness_loss"] == 0.1, 0.6, 0.95)).astype(float)
    inside[:100] = np.nan
    table = coverage_cells(inside, rows, enough=1500)
    counted = (
        rows[100:].assign(inside=inside[100:]).groupby(["stiffness_loss", "snr_db"])["inside"].agg(["size", "mean"])
    )
    assert len(table) == 4  # the severest ones are too few
    for cell in table.itertuples():
        size, share = counted.loc[(cell.stiffness_loss, cell.snr_db)]
        assert (cell.rows, cell.coverage) == (size, pytest.approx(share, rel=1e-12))
        # Rows are independent here, so that the bootstrap's width is the binomial one.
        width = 2 * 1.96 * np.sqrt(share * (1 - share) / size)
        assert cell.high - cell.low == pytest.approx(width, rel=0.35)
    assert (table["low"] > 0.9).tolist() == (table["stiffness_loss"] == 0.2).tolist()
    assert table["below"].tolist() == (table["stiffness_loss"] == 0.1).tolist()
    assert coverage_cells(inside, rows, enough=10_000).empty


def test_cells_are_as_fine_as_the_rows_allow_and_healthy_rows_have_their_own():
    stream = np.random.default_rng(4)
    points = stream.uniform([-30, 13500, 290], [-10, 15300, 420], (25, 3))
    rows = pd.DataFrame(np.tile(points, (1200, 1)), columns=["snr_db", "speed_rpm", "torque"])
    rows = rows.assign(stiffness_loss=0.0, damaged_teeth=np.arange(len(rows)) % 3, specimen=np.arange(len(rows)) % 25)
    table = coverage_cells((rows["damaged_teeth"] > 0).astype(float).to_numpy(), rows)
    assert table.groupby("damaged_teeth")["rows"].sum().tolist() == [10_000] * 3
    # 25 points of 400 rows: halved while halves keep five points.
    assert table["rows"].between(2000, 4000).all()
    assert table["coverage"].tolist() == (table["damaged_teeth"] > 0).tolist()
    own = table[table["damaged_teeth"] == 1]
    assert own["snr_db"].nunique() == own["speed_rpm"].nunique() == len(own) == 4


def test_many_values_are_taken_in_bands_of_like_size():
    values = pd.Series(np.random.default_rng(3).uniform(-20, 0, 6000))
    bands = value_bands(values)
    assert bands.nunique() == 6
    assert bands.value_counts().tolist() == [1000] * 6
    assert (values.groupby(bands).median() - bands.unique()[np.argsort(bands.unique())]).abs().max() < 1e-12
    assert value_bands(values.round(-1)).equals(values.round(-1))


def test_sets_by_hand():
    sets = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 1], [0, 0, 0]], bool)
    rows = pd.DataFrame({"tooth": [0, 2, 1, 0], "specimen": range(4)})
    metrics = estimates(SET_METRICS, set_values(sets, rows["tooth"].to_numpy()), Specimens(rows["specimen"]))
    values = {name: metric.value for name, metric in metrics.items()}
    assert values == pytest.approx(
        {"set_size": 5 / 4, "set_coverage": 2 / 4, "set_coverage_damaged": 1 / 2, "set_coverage_healthy": 1 / 2}
    )
