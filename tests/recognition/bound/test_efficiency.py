"""Unit: the efficiency of a model, against closed forms and rules with a known loss."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.stats import norm

from sigdb.database import QUANTITIES, Template
from sigdb.recognition import (
    ErrorCurve,
    Hypotheses,
    OperatingPoint,
)
from sigdb.recognition.answers import Answers
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import RULES, apply_rule
from sigdb.recognition.bound.efficiency import detection_efficiency, posterior_answers
from sigdb.recognition.bound.expected_losses import error_curve_around, expected_error
from sigdb.recognition.bound.noise_bands import noise_bands
from sigdb.recognition.evaluation_tables import efficiency_table
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.targets.all_targets import TARGETS
from sigdb.recognition.templates.posterior import Posterior

STEP, NOISE = 6, 0.5


def law(signals, tooth, rows, *, teeth):
    """An operating point of templates with these clean averages, nominal gears, and rows (place, tooth)."""
    stored = [
        Template(
            case={"template": i, "tooth": one, "stiffness_loss": 0.1 * i, "phase_shift_deg": 0.0, "damaged_teeth": one},
            signals=np.asarray(signal, float)[None],
            specimen_response=np.zeros((1, len(signal), teeth)),
            harmonic_response=np.zeros((1, len(signal), 0, 2)),
            orders=np.zeros(0),
            reference_variance=np.ones(1),
        )
        for i, (signal, one) in enumerate(zip(signals, tooth, strict=True))
    ]
    hypotheses = Hypotheses.from_templates(stored, teeth=teeth, mate_teeth=3 * teeth)
    place, first = np.transpose(rows)
    frame = pd.DataFrame({"place": place, "tooth": first, "teeth": teeth, "requested": True, "noise": NOISE})
    cases = {name: hypotheses.cases[name].to_numpy()[place] for name in QUANTITIES}
    order = np.arange(len(frame))
    frame = frame.assign(index_error=0.0, specimen=order % 20, snr_db=np.where(order % 2, -1.0, -8.0), **cases)
    return OperatingPoint(hypotheses=hypotheses, rows=frame)


def orthogonal(distance, *, teeth=8, count=16_000):
    """Damage at any of 8 teeth, seen in its own tooth pass only."""
    signal = np.zeros(teeth * STEP)
    signal[2] = distance * NOISE
    return law([signal], [1], [(0, 1 + i // 2 % teeth) for i in range(count)], teeth=teeth)


def bound_of(point, x, target):
    answers = apply_rule(RULES[target], point, [(point.rows, x)])
    losses = [name for name in RULES[target].losses if name in answers]
    return Bound(
        target=target,
        rows=answers.drop(columns=losses),
        losses=answers[losses],
        scores=None,
        outside={},
        expected=None,
        entropy=math.nan,
        points=[point],
    )


def table_of(target, answers, rows, bound):
    return efficiency_table(TARGETS[target], Evaluated.of(answers, rows), bound)


def drawn(point, seed=1):
    place, tooth = (point.rows[name].to_numpy() for name in ("place", "tooth"))
    return point.hypotheses.draw(np.random.default_rng(seed), place, tooth, noise=NOISE, index_error=0.0)


def location_answers(point, x, decibels=0.0):
    """The Bayes rule on averages with so much more noise."""
    posterior = point.posterior(x, point.rows.assign(noise=NOISE * 10 ** (decibels / 20)))
    return Answers(predicted=posterior.tooth, scores=posterior.location, probabilities=np.exp(posterior.location))


@pytest.fixture(scope="module")
def located():
    point = orthogonal(2.5)
    x = drawn(point)
    return point, x, bound_of(point, x, "location")


def test_bands_are_of_equal_width_and_hold_every_row_once():
    snr_db = pd.Series(np.random.default_rng(0).uniform(-29.6, -10.2, 500))
    *bands, every = noise_bands(snr_db)
    assert every.inside.all()
    assert (np.sum([band.inside for band in bands], axis=0) == 1).all()
    assert [(band.low, band.high) for band in bands] == [(-30 + 4 * i, -26 + 4 * i) for i in range(5)]
    for band in bands:
        assert snr_db[band.inside].between(band.low, band.high).all()
    (only,) = noise_bands(pd.Series([3.0, 3.0]))
    assert (only.name, only.low, only.high) == ("all", 3.0, 3.0)


def test_an_excess_is_read_off_the_curve_from_the_error_at_the_rows_own_noise():
    decibels = np.arange(-2.0, 6.1, 0.25)

    def error(level):
        return norm.cdf(-1.5 * 10 ** (-np.asarray(level) / 20))

    curve = ErrorCurve(decibels=decibels, error=error(decibels), standard_error=0 * decibels, chance=0.5)
    assert_allclose(curve.excess_db(error([0.1, 3.0, -1.0]) - error(0.0)), [0.1, 3.0, -1.0], atol=2e-3)
    assert curve.excess_db([0.5, -0.5]).tolist() == [math.inf, -math.inf]
    assert np.isnan(replace(curve, chance=4.0).excess_db(0.01))  # the rule errs too seldom


def test_the_expected_error_is_that_of_the_rows_asked_for():
    """Healthy in three of four rows, and only damaged ones asked about: the shifted threshold misses more of them."""
    d, stream = 2.0, np.random.default_rng(1)
    healthy, difference = stream.standard_normal((2, 3 * STEP))
    damaged = healthy + d * NOISE * difference / np.linalg.norm(difference)
    point = law([healthy, damaged], [0, 1], [(0, 0), (0, 0), (0, 0), (1, 1)], teeth=3)
    point = point.with_request(point.rows.index[point.rows["tooth"] > 0])
    value, error = expected_error([point], draws=20_000)
    assert abs(value - norm.cdf(math.log(3) / d - d / 2)) < 5 * error


def test_a_curve_goes_as_far_as_is_asked_and_resolves_a_quarter_of_a_decibel():
    point = orthogonal(2.5)
    curve = error_curve_around([point], (-0.001, 0.001), draws=2000)
    assert curve.decibels.tolist() == [-0.25, 0.0, 0.25]
    # Common draws: the differences are known far better than the errors.
    fine = error_curve_around([point], (-0.001, 0.001), draws=20_000, seed=3)
    slope, exact = (np.ptp(one.error) for one in (curve, fine))
    assert slope == pytest.approx(exact, rel=0.15)
    assert exact > curve.standard_error[0]


def test_a_rule_that_sees_more_noise_loses_so_many_decibels_in_each_band(located):
    point, x, best = located
    more = NOISE * math.sqrt(10**0.2 - 1)
    worse = location_answers(point, x + more * np.random.default_rng(2).standard_normal(x.shape), 2.0)
    table = table_of("location", worse, point.rows, best)
    assert table["band"].tolist() == ["-8 to -4.5 dB", "-4.5 to -1 dB", "all"]
    for row in table.to_dict("records"):
        assert row["loss_db_low"] < 2.0 < row["loss_db_high"]
        assert row["loss_db_high"] - row["loss_db_low"] < 0.6
        assert row["eta_info_low"] < row["eta_info"] < row["eta_info_high"] < 1
    every = table[table["band"] == "all"].iloc[0]
    wrong = worse.predicted != point.rows["tooth"].to_numpy()
    assert every["error"] == pytest.approx(wrong.mean())
    H, ce = math.log(8), -worse.scores[np.arange(len(wrong)), point.rows["tooth"]].mean()
    assert every["eta_info"] == pytest.approx((H - ce) / (H - best.losses["log_loss"].mean()), rel=1e-9)


def test_the_rule_itself_loses_nothing(located):
    point, x, best = located
    row = table_of("location", location_answers(point, x), point.rows, best).iloc[-1]
    assert [row["loss_db"], row["loss_db_low"], row["loss_db_high"]] == pytest.approx([0.0] * 3, abs=1e-9)
    assert [row["eta_info"], row["eta_info_low"], row["eta_info_high"]] == pytest.approx([1.0] * 3)


def test_rows_outside_of_the_law_do_not_count(located):
    point, x, best = located
    answers, some = location_answers(point, x), best.rows.index[:8000]
    inside = replace(best, rows=best.rows.loc[some], losses=best.losses.loc[some])
    table = table_of("location", answers, point.rows, inside)
    assert table.iloc[-1]["rows"] == 8000


def test_quantiles_of_a_posterior():
    known = Posterior(location=np.zeros((1, 2)), damage=np.log([[0.2, 0.5, 0.3]]))
    level = np.array([3.0, 1.0, 2.0])
    assert [float(known.quantile(level, p)[0]) for p in (0.1, 0.5, 0.6, 0.81, 1.0)] == [1.0, 1.0, 2.0, 3.0, 3.0]
    assert known.median(level).tolist() == known.quantile(level, 0.5).tolist()


def test_severity_is_set_against_median_quantiles_and_mean_of_the_posterior():
    stream = np.random.default_rng(4)
    signals = np.cumsum(0.5 * stream.standard_normal((4, 3 * STEP)), axis=0)
    point = law(signals, [1] * 4, [(i % 4, 1 + i % 3) for i in range(2400)], teeth=3)
    best = bound_of(point, drawn(point), "severity")
    exact = posterior_answers(best.rows)
    row = table_of("severity", Answers(predicted=exact), point.rows, best).iloc[-1]
    assert row["quantity"] == "stiffness_loss"  # the others do not vary
    assert row["mae_ratio"] == row["crps_ratio"] == 1
    true = point.rows["stiffness_loss"].to_numpy()
    shifted = exact.assign(stiffness_loss=best.rows["mean_stiffness_loss"] + 0.05)
    row = table_of("severity", Answers(predicted=shifted), point.rows, best).iloc[-1]
    error = np.abs(shifted["stiffness_loss"] - true)
    assert row["mae_ratio"] == pytest.approx(error.mean() / np.abs(exact["stiffness_loss"] - true).mean())
    assert row["mae_ratio_low"] < row["mae_ratio"] < row["mae_ratio_high"]
    square = ((best.rows["mean_stiffness_loss"] - true) ** 2).mean()
    assert row["rmse_ratio"] == pytest.approx(math.sqrt((error**2).mean() / square))


def scored_rows():
    loss = np.tile([0.0, 0.1, 0.2, 0.3, 0.4], 4000)
    return pd.DataFrame(
        {
            "tooth": (loss > 0) * 1,
            "teeth": 1,
            "stiffness_loss": loss,
            "phase_shift_deg": 0.0,
            "snr_db": 0.0,
            "specimen": np.arange(len(loss)) // 5 % 40,
        }
    )


def of_scores(slope, best_slope):
    """a90 of detection by ``slope * loss + noise``, beside that of another slope and the same noise."""
    rows = scored_rows()
    noise = np.random.default_rng(5).logistic(size=len(rows))
    score, log_odds = (one * rows["stiffness_loss"].to_numpy() + noise for one in (slope, best_slope))
    blank = pd.DataFrame({"log_odds": log_odds}, rows.index)
    best = Bound(
        target="location", rows=blank, losses=pd.DataFrame(index=rows.index), scores=None, outside={}, expected=None,
        entropy=math.nan,
    )  # fmt: skip
    zeros = np.zeros(len(rows))
    answers = Answers(predicted=zeros.astype(int), scores=np.column_stack([zeros, score]))
    return detection_efficiency(Evaluated.of(answers, rows), best)


def test_a90_goes_as_the_inverse_of_the_slope_of_the_score():
    same, flatter = of_scores(40.0, 40.0), of_scores(32.0, 40.0)
    assert [same["a90_ratio"], same["a90_ratio_low"], same["a90_ratio_high"]] == [1, 1, 1]
    # The threshold at 1e-3, logit(0.999), plus logit(0.9), over the slope.
    assert same["a90"] == pytest.approx((math.log(999) + math.log(9)) / 40, rel=0.05)
    assert flatter["a90_ratio"] == pytest.approx(40 / 32, rel=0.02)
    assert flatter["a90_ratio_low"] < flatter["a90_ratio"] < flatter["a90_ratio_high"]
    assert of_scores(5.0, 40.0)["a90_ratio"] == math.inf  # no loss of the rows is found so often
