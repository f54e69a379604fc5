"""The Bayes bound: against closed forms, against its own rows, and what it says of models."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import binom, multivariate_normal, norm, ttest_1samp

from sigdb.core import InputError, NotApplicableError
from sigdb.database import QUANTITIES, Template
from sigdb.measurement import index_error_covariance
from sigdb.recognition import (
    ErrorCurve,
    Hypotheses,
    OperatingPoint,
    above_bound,
    bayes_bound,
    error_curve,
    eta_info,
    expected_losses,
    operating_points,
    optimal_roc,
    smallest_detected_loss,
)
from sigdb.recognition.bound import operating_points as rows_by_point
from sigdb.recognition.templates.posterior import Posterior

STEP, NOISE = 6, 0.5


def point(signals, tooth, *, teeth, rows, response=None, index_error=0.0, **severities):
    """An operating point of templates with these clean averages, and rows (place, tooth)."""
    stored = [
        Template(
            case={"template": i, "tooth": one, "stiffness_loss": 0.0, "phase_shift_deg": 0.0, "damaged_teeth": one}
            | {name: values[i] for name, values in severities.items()},
            signals=np.asarray(signal, float)[None],
            specimen_response=(np.zeros((len(signal), teeth)) if response is None else response)[None],
            harmonic_response=np.zeros((1, len(signal), 0, 2)),
            orders=np.zeros(0),
            reference_variance=np.ones(1),
        )
        for i, (signal, one) in enumerate(zip(signals, tooth, strict=True))
    ]
    hypotheses = Hypotheses.from_templates(stored, teeth=teeth, mate_teeth=3 * teeth)
    frame = pd.DataFrame(rows, columns=["place", "tooth"])
    frame = frame.assign(teeth=teeth, specimen=0, requested=True, noise=NOISE, index_error=index_error)
    for name in QUANTITIES:
        frame[name] = hypotheses.cases[name].to_numpy()[frame["place"]]
    return OperatingPoint(hypotheses=hypotheses, rows=frame)


def between(losses, **options):
    """Signals that are linear in the loss, at 3 teeth; half of the rows are healthy."""
    change = np.zeros(3 * STEP)
    change[2] = 20 * NOISE
    rows = [(0, 0)] * 3 * (len(losses) - 1) + [(k, t) for k in range(1, len(losses)) for t in (1, 2, 3)]
    signals = [loss * change for loss in losses]
    tooth = [int(loss > 0) for loss in losses]
    return point(signals, tooth, teeth=3, rows=rows, stiffness_loss=list(losses), **options)


def two_signals(distance, **options):
    """Healthy or damaged at tooth 1 of 3, half of the rows each; the signals are so many deviations apart."""
    stream = np.random.default_rng(1)
    difference = stream.standard_normal(3 * STEP)
    healthy = stream.standard_normal(3 * STEP)
    damaged = healthy + distance * NOISE * difference / np.linalg.norm(difference)
    return point([healthy, damaged], [0, 1], teeth=3, rows=[(0, 0), (1, 1)], **options)


def orthogonal(distance, teeth=8):
    """Damage at any of 8 teeth, seen in its own tooth pass only."""
    signal = np.zeros(teeth * STEP)
    signal[2] = distance * NOISE
    return point([signal], [1], teeth=teeth, rows=[(0, t) for t in range(1, teeth + 1)])


def test_the_best_answer_knows_the_colour_of_the_noise():
    """The likelihood is that of the full covariance; drawn averages have it."""
    white = two_signals(3.0)
    n = white.hypotheses.signal.shape[1]
    shape = np.linspace(2.0, 0.5, n // 2 + 1)
    coloured = replace(white, colours=np.stack([np.ones(n // 2 + 1), shape]))
    rows = pd.DataFrame({"noise": NOISE, "index_error": 0.0, "colour": [0, 1]}, index=[4, 5])
    x = np.random.default_rng(3).standard_normal((2, n))
    turned = np.fft.irfft(np.fft.rfft(np.eye(n), axis=1) * shape**2, n, axis=1)
    likelihood = coloured.log_likelihood(x, rows)
    for i, covariance in enumerate((np.eye(n), turned)):
        density = [
            multivariate_normal(signal, NOISE**2 * covariance).logpdf(x[i]) for signal in white.hypotheses.signal
        ]
        assert_allclose(likelihood[i, 1, 0] - likelihood[i, 0, 0], density[1] - density[0], rtol=1e-9)
    one = replace(coloured, rows=coloured.rows.assign(colour=1))
    ((drawn, averages),) = one.redrawn(np.random.default_rng(5), 2000)
    noise = averages - white.hypotheses.signal[drawn["place"]]
    power = (np.abs(np.fft.rfft(noise, axis=1)) ** 2).mean(axis=0) / n
    assert_allclose(power / (NOISE * shape) ** 2, 1.0, atol=0.25)


@pytest.mark.parametrize("distance", [1.0, 2.0, 3.5])
def test_two_equally_likely_signals_are_confused_with_probability_phi_of_minus_half_their_distance(distance):
    value, error = expected_losses([two_signals(distance)], "location", draws=20_000)["error"]
    assert error < 0.01
    assert abs(value - norm.cdf(-distance / 2)) < 5 * error


def test_index_errors_bring_two_signals_nearer_by_the_inverse_of_their_covariance():
    difference = np.diff(two_signals(3.0).hypotheses.signal, axis=0)[0]
    response = 1e5 * np.random.default_rng(2).standard_normal((3 * STEP, 3))
    response[:, 0] += 4e5 * difference
    two = two_signals(3.0, response=response, index_error=5e-6)
    errors = (5e-6) ** 2 * response @ index_error_covariance(3, 9) @ response.T
    distance = math.sqrt(difference @ np.linalg.solve(NOISE**2 * np.eye(3 * STEP) + errors, difference))
    assert distance < 2.8
    value, error = expected_losses([two], "location", draws=20_000)["error"]
    assert abs(value - norm.cdf(-distance / 2)) < 5 * error
    nominal, error = expected_losses([two], "location", draws=20_000, specimens=False)["error"]
    assert abs(nominal - norm.cdf(-3.0 / 2)) < 5 * error


@pytest.mark.parametrize("distance", [1.5, 3.0])
def test_orthogonal_signals_are_told_apart_as_the_textbook_integral_says(distance):
    """P(right of M) = integral of phi(y - d) Phi(y)^(M - 1): the right one is the greatest of M projections."""
    right, _ = quad(lambda y: norm.pdf(y - distance) * norm.cdf(y) ** 7, -9, 12)
    value, error = expected_losses([orthogonal(distance)], "location", draws=20_000)["error"]
    assert abs(1 - value - right) < 5 * error


def test_the_rule_is_as_sure_as_it_is_right():
    """In bins of its own risk; the number of errors in each is binomial."""
    one = orthogonal(2.0)
    known = [(one.posterior(x, rows), rows) for rows, x in one.redrawn(np.random.default_rng(3), 20_000)]
    risk = np.concatenate([posterior.risk for posterior, _ in known])
    wrong = np.concatenate([posterior.tooth != rows["tooth"] for posterior, rows in known])
    edges = np.quantile(risk, np.linspace(0, 1, 6)[1:-1])
    for bin in range(5):
        here = np.digitize(risk, edges) == bin
        assert binom.sf(wrong[here].sum() - 1, here.sum(), risk[here].mean()) > 1e-5
        assert binom.cdf(wrong[here].sum(), here.sum(), risk[here].mean()) > 1e-5


def test_risk_and_entropy_are_small_without_being_rounded_away():
    location = np.log(np.array([[1e-30, 3e-30]]))
    location = np.column_stack([[0.0], location])
    known = Posterior(location=location, damage=location[:, 1:])
    assert_allclose(known.risk, 4e-30)
    assert_allclose(known.entropy, -(1e-30 * math.log(1e-30) + 3e-30 * math.log(3e-30)))
    assert_allclose(known.log_odds, math.log(4e-30))


def test_mean_median_and_crps_by_hand():
    """Levels 0.4, 0.0, 0.2 have 0.45, 0.45, 0.1 of the posterior: F is 0.45 from 0.0 on, 0.55 from 0.2, 1 from 0.4."""
    known = Posterior(location=np.zeros((1, 2)), damage=np.log([[0.45, 0.45, 0.1]]))
    level = np.array([0.4, 0.0, 0.2])
    assert_allclose(known.mean(level), 0.4 * 0.45 + 0.2 * 0.1)
    assert_allclose(known.median(level), 0.2)
    assert_allclose(known.crps(level, np.array([0.2])), 0.2 * 0.45**2 + 0.2 * 0.45**2)
    assert_allclose(known.crps(level, np.array([0.0])), 0.2 * 0.55**2 + 0.2 * 0.45**2)


def test_losses_of_two_severities_are_those_of_their_distance():
    """Levels 0 and 1, equally likely, d apart: with p = P(1 | y) the median errs in Phi(-d / 2) of the cases, by 1; the
    mean's square and the CRPS are both E[p (1 - p)]."""
    d, difference = 2.0, np.eye(12)[3]
    signals, level = [np.zeros(12), 2.0 * NOISE * difference], [0.0, 1.0]
    one = point(signals, [1, 1], teeth=2, rows=[(0, 1), (1, 1)], stiffness_loss=level)

    def density(y):
        p = 1 / (1 + math.exp(d * (d / 2 - y)))
        return p * (1 - p) * (norm.pdf(y) + norm.pdf(y - d)) / 2

    square, _ = quad(density, -9, 11)
    found = expected_losses([one], "severity", draws=20_000)
    expected = {"absolute": norm.cdf(-d / 2), "square": square, "crps": square}
    for kind, due in expected.items():
        value, error = found[f"{kind}_stiffness_loss"]
        assert error < 0.01
        assert abs(value - due) < 5 * error


def test_the_bayes_rule_loses_no_decibels_and_one_with_twice_the_noise_loses_three():
    """The closed form Phi(-d / 2), with sqrt(2) more noise d / sqrt(2); lines between levels 1.5 dB apart."""
    decibels = np.arange(-3.0, 12.1, 1.5)
    curve = ErrorCurve(
        decibels=decibels,
        error=norm.cdf(-3 * 10 ** (-decibels / 20) / 2),
        standard_error=np.zeros(len(decibels)),
        chance=0.5,
    )
    assert_allclose(curve.loss_db(norm.cdf(-1.5)), 0.0, atol=0.02)
    assert_allclose(curve.loss_db(norm.cdf(-1.5 / math.sqrt(2))), 10 * math.log10(2), atol=0.02)
    assert np.isnan(curve.loss_db([0.009, 0.41, 0.499])).all()  # too few errors, too near to chance, off the curve


def test_a_rule_that_adds_as_much_noise_again_loses_three_decibels():
    """Its errors are counted; the tolerance is five times their error, by the slope of the curve, and the curve's."""
    one, draws = orthogonal(3.5), 20_000
    curve = error_curve([one], np.arange(-1.5, 7.6, 1.5), draws=8000, seed=5)
    stream, wrong = np.random.default_rng(4), 0
    for rows, x in one.redrawn(stream, draws):
        worse = rows.assign(noise=math.sqrt(2) * rows["noise"])
        found = one.posterior(x + NOISE * stream.standard_normal(x.shape), worse).tooth
        wrong += int((found != rows["tooth"]).sum())
    error = wrong / draws
    slope = float(np.interp(3.0, curve.decibels, np.gradient(curve.error, curve.decibels)))
    tolerance = 5 * math.hypot(math.sqrt(error * (1 - error) / draws), curve.standard_error.max()) / slope
    assert tolerance < 1.0
    assert abs(float(curve.loss_db(error)) - 10 * math.log10(2)) < tolerance
    bayes, _ = expected_losses([one], "location", draws=8000, seed=5)["error"]
    assert_allclose(curve.loss_db(bayes), 0.0, atol=1e-9)


def test_chance_of_a_curve_is_the_most_frequent_answer():
    one = point([np.zeros(12), np.ones(12)], [0, 1], teeth=2, rows=[(0, 0), (0, 0), (1, 1), (1, 2)])
    assert error_curve([one], [40.0], draws=4).chance == pytest.approx(0.5)


def test_efficiency_is_the_share_of_the_information():
    entropy = math.log(13)
    assert eta_info(entropy, 0.5, 0.5) == 1
    assert eta_info(entropy, entropy, 0.5) == 0
    assert eta_info(entropy, 2 * entropy, 0.5) < 0
    assert math.isnan(eta_info(entropy, 0.2, 0.04 * entropy))
    assert math.isnan(eta_info(entropy, entropy, 0.96 * entropy))


def test_entropy_before_an_average_is_seen_is_that_of_the_rows():
    one = point([np.zeros(12), np.ones(12)], [0, 1], teeth=2, rows=[(0, 0), (0, 0), (1, 1), (1, 2)])
    assert_allclose(one.prior.entropy, [1.5 * math.log(2)])
    assert_allclose(np.exp(one.prior.location), [[0.5, 0.25, 0.25]])


def test_equal_models_are_called_above_the_bound_once_in_a_hundred_times():
    """With five specimens, that share effects: 2000 trials of losses of the same law; bounds of one in 10^4."""
    stream, trials, specimens = np.random.default_rng(6), 2000, np.repeat(np.arange(5), 20)
    found = 0
    for _ in range(trials):
        effect = np.repeat(stream.standard_normal(5), 20)
        found += above_bound(effect + stream.standard_normal(100), np.zeros(100), specimens).significant
    assert binom.cdf(found, trials, 0.01) > 1e-4
    assert binom.sf(found - 1, trials, 0.01) > 1e-4


def test_one_specimen_or_equal_losses_prove_nothing():
    assert not above_bound(np.zeros(9), np.ones(9), np.zeros(9)).significant
    assert not above_bound(np.ones(9), np.ones(9), np.arange(9)).significant
    assert above_bound(np.zeros(9), np.ones(9), np.arange(9)).significant
    with pytest.raises(InputError, match=r"2 losses of the model, 3 of the bound, 3 specimens; give those of the same"):
        above_bound([0, 0], [1, 1, 1], [0, 1, 2])


def test_equally_many_rows_of_a_specimen_make_it_the_t_test_of_their_means():
    gain = np.random.default_rng(9).standard_normal((6, 4)) + 0.3
    found = above_bound(-gain.ravel(), np.zeros(24), np.repeat(np.arange(6), 4))
    assert_allclose(found.value, gain.mean())
    assert_allclose(found.p_value, ttest_1samp(gain.mean(axis=1), 0, alternative="greater").pvalue)


def test_a_rule_that_knows_the_specimens_is_above_the_bound_and_an_honest_one_is_not():
    """40 specimens, 30 rows each; the first rule takes their index errors out of the averages, as a leak would."""
    stream = np.random.default_rng(7)
    tooth = 2e5 * stream.standard_normal(24)
    response = np.stack([np.roll(tooth, 6 * j) for j in range(4)], axis=1)
    # The damage looks for the most part like an index error of its tooth.
    signals = [np.zeros(24), 0.15 * stream.standard_normal(24) + 1e-6 * tooth]
    one = point(signals, [0, 1], teeth=4, rows=[(0, 0), *((1, t) for t in range(1, 5))], response=response)
    specimens = np.repeat(np.arange(40), 30)
    rows = one.rows.iloc[stream.integers(5, size=len(specimens))].assign(index_error=5e-6)
    errors = 5e-6 * stream.multivariate_normal(np.zeros(4), index_error_covariance(4, 12), 40)[specimens]
    turn = np.maximum(rows["tooth"].to_numpy() - 1, 0)
    clean = one.hypotheses.draw(stream, rows["place"].to_numpy(), rows["tooth"].to_numpy(), noise=NOISE, index_error=0)
    moved = np.array([np.roll(response @ np.roll(e, -t), 6 * t) for e, t in zip(errors, turn, strict=True)])
    true = rows["tooth"].to_numpy()
    best = one.posterior(clean + moved, rows).tooth != true
    honest = one.posterior(clean + moved, rows.assign(index_error=0.0)).tooth != true
    leaky = one.posterior(clean, rows.assign(index_error=0.0)).tooth != true
    assert above_bound(leaky, best, specimens).significant
    assert not above_bound(honest, best, specimens).significant
    assert above_bound(honest, best, specimens).value < 0


@pytest.mark.parametrize("rate", [1e-1, 1e-2, 1e-4])
def test_detection_of_a_known_signal_is_that_of_the_matched_filter(rate):
    """P(detection) = Phi(d - z), z the quantile of the false alarms."""
    roc = optimal_roc(two_signals(3.0), np.array([1]), draws=4000)
    value, error = roc.at(rate)
    assert 0 < error < 0.02
    assert abs(value - norm.cdf(3.0 + ndtri(rate))) < 5 * error


def test_false_alarms_of_the_likelihood_ratio_are_as_many_as_it_says():
    """Damage at any tooth, with index errors; the ratio's 1 % threshold on healthy averages drawn apart."""
    stream = np.random.default_rng(8)
    response = 1e5 * stream.standard_normal((24, 4))
    signals = [np.zeros(24), 0.5 * stream.standard_normal(24)]
    rows = [(0, 0), *((1, t) for t in range(1, 5))]
    one = point(signals, [0, 1], teeth=4, rows=rows, response=response, index_error=4e-6)
    roc = optimal_roc(one, np.array([1]), draws=10_000)
    threshold = np.interp(0.01, roc.false_alarm_rate, roc.log_ratio)
    healthy, draws = one.rows.iloc[np.zeros(20_000, int)], 20_000
    x = one.hypotheses.draw(stream, np.zeros(draws, int), np.zeros(draws, int), noise=NOISE, index_error=4e-6)
    # Half of the posterior odds' prior is known: a fifth healthy.
    ratio = one.posterior(x, healthy).log_odds - math.log(4)
    alarms = int((ratio > threshold).sum())
    assert abs(alarms / draws - 0.01) < 5 * math.sqrt(0.01 * 0.99 / draws + (0.01 * 0.05) ** 2)


def test_nothing_is_found_where_no_loss_is_great_enough():
    assert math.isnan(smallest_detected_loss(np.array([0.2, 0.4]), np.array([0.01, 0.6]), draws=1000))


def test_the_bound_on_the_rows_of_a_database(database):
    found = bayes_bound(database, draws=2000)
    assert found.outside == {}
    assert len(found.rows) == len(database)
    assert list(found.losses) == ["error", "log_loss"]
    assert set(found.metrics) == {
        "accuracy",
        "p_exact",
        "p_within_one",
        "p_detected",
        "circular_bias",
        "none_on_healthy",
        "log_loss",
    }
    assert found.metrics["accuracy"].value == 1
    counts = database.cases()["tooth"].value_counts(normalize=True).to_numpy()
    assert found.entropy == pytest.approx(-(counts * np.log(counts)).sum())
    assert found.expected["error"][0] < 1e-3


def test_the_bound_on_severity_is_of_damaged_rows(database):
    ids = np.arange(0, len(database), 3)
    found = bayes_bound(database, ids, target="severity")
    damaged = database.cases("tooth > 0")["id"]
    assert found.rows.index.tolist() == sorted(set(ids) & set(damaged))
    assert set(found.metrics) == {
        f"{kind}_{name}"
        for kind in ("mae", "rmse", "crps")
        for name in ("stiffness_loss", "phase_shift_deg", "damaged_teeth")
    }
    assert found.metrics["rmse_stiffness_loss"].value < 1e-3


def test_the_share_of_templates_is_that_of_all_rows_whichever_are_asked_for(database):
    """The answer is not to be had from which rows are asked for."""
    one = database.cases("tooth = 5")["id"].to_numpy()[:1]
    (some,), _ = operating_points(database, one)
    (all_rows,), _ = operating_points(database)
    assert some.rows["requested"].sum() == 1
    assert np.array_equal(some.log_prior, all_rows.log_prior)


def test_metrics_are_means_of_values_and_scores_are_the_posterior(mixed_teeth):
    found = bayes_bound(mixed_teeth)
    assert found.scores.shape == (len(mixed_teeth), 14)
    assert np.array_equal(found.scores.to_numpy().argmax(axis=1), found.rows["predicted"])
    assert_allclose(np.exp(found.scores).sum(axis=1), 1)
    assert np.isneginf(found.scores.loc[found.rows["teeth"] == 12, 13]).all()
    true = found.scores.to_numpy()[np.arange(len(found.rows)), found.rows["tooth"]]
    assert_allclose(found.losses["log_loss"], -true)
    for name, metric in found.metrics.items():
        assert_allclose(metric.value, np.nanmean(found.values[name]))


def test_noise_of_a_row_is_that_of_its_average(mixed_teeth):
    """By the definition of snr_db: the variance of the healthy average, here itself, over that of one revolution."""
    cases, templates = mixed_teeth.cases().set_index("id"), mixed_teeth.templates()
    for one in operating_points(mixed_teeth)[0]:
        healthy = templates[(templates["tooth"] == 0) & (templates["teeth"] == one.hypotheses.teeth)]
        rows = cases.loc[one.rows.index]
        variance = np.var(healthy["tsa"].iloc[0].astype(float)) * 10 ** (-rows["snr_db"] / 10) / rows["averages"]
        assert_allclose(one.rows["noise"], np.sqrt(variance), rtol=1e-5)


def test_each_tooth_count_has_its_own_hypotheses(mixed_teeth):
    points, _ = operating_points(mixed_teeth)
    assert sorted(one.hypotheses.teeth for one in points) == [12, 13]
    found = bayes_bound(mixed_teeth)
    assert set(found.rows["teeth"]) == {12, 13}
    assert found.metrics["accuracy"].value == 1


def test_errors_on_stored_rows_are_as_many_as_the_rule_expects(make_database):
    """Much noise; rows of a specimen are not independent, so the interval is that over specimens."""
    grid = 'tooth = "all"\nstiffness_loss = [0.1, 0.2]'
    noisy = make_database(seed=11, specimens=30, healthy=5, grid=grid, snr_db=-25.0)
    found = bayes_bound(noisy, draws=4000)
    surplus = found.losses["error"] - found.rows["risk"]
    assert 0.1 < found.rows["risk"].mean() < 0.8
    assert abs(surplus.mean()) < 5 * error_over_specimens(surplus, found)
    expected, error = found.expected["error"]
    scatter = error_over_specimens(found.losses["error"], found)
    assert abs(found.losses["error"].mean() - expected) < 5 * math.hypot(error, scatter)


def error_over_specimens(values, found):
    """Standard error of a mean over rows, of specimens of equally many rows."""
    means = values.groupby(found.rows["specimen"]).mean()
    return means.std() / math.sqrt(len(means))


def test_rows_outside_the_law_are_counted(database, monkeypatch):
    """Some damaged rows as they would be if their mesh lost contact, if they had no result, or had a pattern."""
    rows = rows_by_point._rows(database)
    damaged = rows.index[rows["tooth"] > 0]
    rows.loc[damaged[:5], "contact_loss"] = True
    rows.loc[damaged[5:8], "done"] = False
    rows.loc[damaged[8:10], "patterned"] = True
    monkeypatch.setattr(rows_by_point, "_rows", lambda database, sensor=None: rows)
    found = bayes_bound(database, damaged[3:])
    assert found.outside == {"without a result": 3, "with loss of contact": 2}
    assert found.rows.index.tolist() == damaged[8:].tolist()
    found = bayes_bound(database, target="severity")
    assert found.outside == {"without a result": 3, "with loss of contact": 5, "with a pattern of damage": 2}
    assert found.rows.index.tolist() == damaged[10:].tolist()
    with pytest.raises(NotApplicableError, match=r"no row follows the law of the bound .*'with loss of contact': 4"):
        bayes_bound(database, damaged[:4])


def test_an_unknown_target_is_refused(database):
    with pytest.raises(InputError, match="target = 'colour' does not exist; choose one of location, severity"):
        bayes_bound(database, target="colour")


def test_detection_needs_both_kinds_of_rows():
    with pytest.raises(InputError, match="detection needs both healthy and damaged rows"):
        optimal_roc(orthogonal(2.0), np.array([0]))


def test_a_rule_without_known_cells_takes_any_severity_between_those_of_the_templates():
    """The location follows from the density integrated over the loss, for averages of losses between the templates."""
    some = between((0.0, 0.1, 0.25, 0.4))
    unknown = replace(some, known_cells=False)
    x = NOISE * np.random.default_rng(2).standard_normal((4, 3 * STEP))
    x[1, 2] += 0.17 * 20 * NOISE
    x[2, 2 + STEP] += 0.3 * 20 * NOISE
    rows = some.rows.iloc[:4]

    def density(average, tooth):
        """Likelihood of damage at a tooth over that of none."""
        at = average[2 + (tooth - 1) * STEP] / NOISE
        return quad(lambda loss: norm.pdf(at - 20 * loss) / norm.pdf(at) / 0.4, 0, 0.4)[0]

    odds = np.array([[density(average, tooth) / 3 for tooth in (1, 2, 3)] for average in x])
    expected = np.column_stack([np.ones(4), odds]) / (1 + odds.sum(axis=1, keepdims=True))
    assert_allclose(np.exp(unknown.posterior(x, rows).location), expected, rtol=0.04)  # as stated for steep densities
    assert np.abs(np.exp(some.posterior(x, rows).location) - expected).max() > 0.05
    assert unknown.requested.known_cells
