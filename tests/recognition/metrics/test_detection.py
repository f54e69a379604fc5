"""Unit and verification: detection at low false-alarm rates and against severity, by definition and by known laws."""

import numpy as np
import pandas as pd
import pytest
from scipy.special import expit, logit
from scipy.stats import norm
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_curve

from sigdb.recognition.metrics.detection import detected_share, detection_at_rates, is_resolved, roc, thresholds
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.metrics.pod_curve import LINKS, PodCurve, curve_of_link, pod_curve
from sigdb.recognition.metrics.probability_of_detection import a90_estimates, detection_by_loss


def parts(rows):
    """Healthy rows, and specimens."""
    return (rows["tooth"] == 0).to_numpy(), Specimens(rows["specimen"])


def frame(healthy, damaged, specimens=20, **columns):
    tooth = np.repeat([0, 4], [healthy, damaged])
    return pd.DataFrame({"tooth": tooth, "specimen": np.arange(len(tooth)) % specimens} | columns)


def least_threshold(healthy, rate):
    """The definition, tried out on every score."""
    return min(t for t in healthy if (healthy > t).mean() <= rate + 1e-12)


@pytest.mark.parametrize("decimals", [9, 0])
def test_thresholds_and_detection_are_those_of_resampled_rows(decimals):
    stream = np.random.default_rng(1)
    rows = frame(300, 80, specimens=7)
    score = np.round(stream.normal(0, 2, 380) + (rows["tooth"] > 0), decimals)
    healthy, rates = (rows["tooth"] == 0).to_numpy(), [0.01, 0.05, 0.5]
    specimens = Specimens(rows["specimen"])
    threshold = thresholds(score, healthy, specimens, rates)
    found = detected_share(score, ~healthy, specimens, threshold)
    for k in range(4):
        times = specimens.weights[k].astype(int)[specimens.index]
        at = np.repeat(np.arange(380), times)
        expected = [least_threshold(score[at][healthy[at]], rate) for rate in rates]
        np.testing.assert_array_equal(threshold[k], expected)
        np.testing.assert_allclose(found[k], [(score[at][~healthy[at]] > t).mean() for t in expected], rtol=1e-12)


def test_detection_of_gaussian_scores():
    """Healthy N(0, 1), damaged N(d, 1): the probability of detection at the rate a is Phi(d - Phi^-1(1 - a))."""
    stream, d = np.random.default_rng(2), 3.0
    rows = frame(40_000, 20_000, specimens=50)
    score = stream.normal(size=60_000) + d * (rows["tooth"] > 0)
    detected = detection_at_rates(score, *parts(rows))
    for rate, error in ((1e-2, 0.01), (1e-3, 0.02), (1e-4, 0.06)):
        estimate = detected[f"pd_at_1e{round(np.log10(rate))}"]
        expected = norm.cdf(d - norm.ppf(1 - rate))
        assert estimate.value == pytest.approx(expected, abs=error)
        assert estimate.low < estimate.value < estimate.high
        assert estimate.low - error < expected < estimate.high + error


@pytest.mark.parametrize(("healthy", "known"), [(299, 0), (300, 1), (2999, 1), (3000, 2), (29_999, 2), (30_000, 3)])
def test_a_rate_needs_three_healthy_rows_for_one_false_alarm(healthy, known):
    assert sum(is_resolved(rate, healthy) for rate in (1e-2, 1e-3, 1e-4)) == known
    if healthy < 4000:
        detected = detection_at_rates(np.arange(healthy + 5.0), *parts(frame(healthy, 5)))
        assert sum(not np.isnan(estimate.value) for estimate in detected.values()) == known


def test_roc_is_that_of_scikit_learn():
    stream = np.random.default_rng(3)
    rows = frame(500, 300)
    score = stream.normal(size=800) + 1.5 * (rows["tooth"] > 0)
    table = roc(score, *parts(rows))
    false, true, _ = roc_curve(rows["tooth"] > 0, score, drop_intermediate=False)
    expected = [true[false <= rate * (1 + 1e-9)].max() for rate in table["false_alarm_rate"]]
    np.testing.assert_allclose(table["detected"], expected, rtol=1e-12)
    assert table["false_alarm_rate"].iloc[[0, -1]].tolist() == pytest.approx([3 / 500, 1])
    assert table["detected"].is_monotonic_increasing


def test_scores_without_information_detect_as_often_as_they_alarm():
    score = np.random.default_rng(4).normal(size=30_000)
    table = roc(score, *parts(frame(20_000, 10_000)))
    share, rate = table["detected"], table["false_alarm_rate"]
    assert (np.abs(share - rate) <= 4 * np.sqrt(rate * (1 - rate) * (1 / 10_000 + 1 / 20_000)) + 1e-4).all()


A = np.array([0.1, 0.2, 0.3, 0.4, 0.5])


def drawn(stream, *, specimens, per_level, intercept=-6.0, slope=20.0):
    rows = np.full((specimens, len(A)), float(per_level))
    return stream.binomial(per_level, expit(intercept + slope * A), (specimens, len(A))).astype(float), rows


def test_the_curve_is_the_logistic_regression():
    hits, rows = drawn(np.random.default_rng(5), specimens=30, per_level=4)
    curve = curve_of_link(LINKS["logit"], A, hits, rows)
    x, y = np.repeat(A, 2), np.tile([1, 0], len(A))
    weights = np.column_stack([hits.sum(axis=0), (rows - hits).sum(axis=0)]).ravel()
    peer = LogisticRegression(C=np.inf, tol=1e-10, max_iter=10_000).fit(x[:, None], y, weights)
    assert curve.slope == pytest.approx(peer.coef_[0, 0], rel=1e-4)
    assert curve.intercept == pytest.approx(peer.intercept_[0], rel=1e-4)
    assert curve.severity(0.9) == pytest.approx((logit(0.9) - curve.intercept) / curve.slope)
    assert curve.probability(curve.severity(0.9)) == pytest.approx(0.9)


def test_the_covariance_is_the_sandwich_over_specimens():
    hits, rows = drawn(np.random.default_rng(6), specimens=8, per_level=5)
    curve = curve_of_link(LINKS["logit"], A, hits, rows)
    information, meat = np.zeros((2, 2)), np.zeros((2, 2))
    for of_specimen, n in zip(hits, rows, strict=True):
        gradient = np.zeros(2)
        for a, k, m in zip(A, of_specimen, n, strict=True):
            x, p = np.array([1, a]), 1 / (1 + np.exp(-curve.intercept - curve.slope * a))
            gradient += (k - m * p) * x
            information += m * p * (1 - p) * np.outer(x, x)
        meat += np.outer(gradient, gradient)
    expected = 8 / 7 * np.linalg.inv(information) @ meat @ np.linalg.inv(information)
    np.testing.assert_allclose(curve.covariance, expected, rtol=1e-6)


def test_the_bound_of_a90_is_where_the_lower_bound_of_the_curve_has_it():
    hits, rows = drawn(np.random.default_rng(7), specimens=30, per_level=4)
    curve = pod_curve(A, hits, rows)
    a = curve.severity_bound(0.9)
    assert a > curve.severity(0.9)
    assert curve.bound(a) == pytest.approx(0.9, abs=2e-3)  # interpolated
    # A slope that may as well be 0: the lower bound never comes up.
    weak = pod_curve(A, np.tile([2.0, 2.0, 2.0, 3.0, 2.0], (3, 1)), np.full((3, 5), 4.0))
    assert weak.slope > 0
    assert np.isnan(weak.severity_bound(0.9))
    assert (weak.bound(A) < 0.9).all()


@pytest.mark.parametrize("slope", [1e-3, 1e-12, 1e-16])
@pytest.mark.parametrize(("a", "hits", "rows"), [((0.3, 0.6), (1, 1), 3570), ((0.2, 0.4, 0.6), (43, 43, 43), 105)])
def test_a_curve_that_hardly_rises_has_no_bound_of_a90(a, hits, rows, slope):
    """As many are detected of each severity: a90 is so far from them that no likelihood tells."""
    curve = PodCurve(
        link=LINKS["logit"],
        intercept=float(logit(hits[0] / rows)),
        slope=slope,
        covariance=np.eye(2),
        inflation=1.0,
        a=np.array(a),
        hits=np.array(hits, float),
        rows=np.full(len(a), float(rows)),
    )
    assert np.isnan(curve.severity_bound())


def test_the_bound_of_a90_is_the_profile_of_the_likelihood():
    """Independent: the likelihood on a grid of curves, each by its a90 and slope."""
    hits, rows = drawn(np.random.default_rng(12), specimens=30, per_level=4)
    curve = curve_of_link(LINKS["probit"], A, hits, rows)
    hit, of = hits.sum(axis=0), rows.sum(axis=0)
    a90 = np.linspace(curve.severity(0.9), curve.severity(0.9) + 0.3, 1501)[:, None, None]
    slope = np.linspace(0.2, 3, 801)[None, :, None] * curve.slope
    log_p, log_q = norm.logcdf(norm.ppf(0.9) + slope * (A - a90)), norm.logsf(norm.ppf(0.9) + slope * (A - a90))
    profile = (log_p @ hit + log_q @ (of - hit)).max(axis=1)
    inside = 2 * (profile[0] - profile) <= curve.inflation * norm.ppf(0.95) ** 2
    assert curve.severity_bound(0.9) == pytest.approx(a90[inside].max(), abs=1e-3)


def test_the_link_is_the_one_of_the_rows():
    """Many rows of a normal law of hits: the probit link is more likely, and of a logistic one the logit link."""
    wide = np.linspace(0.05, 0.95, 10)
    n = np.full((1, 10), 1e6)
    assert pod_curve(wide, n * norm.cdf(8 * (wide - 0.4)), n).link.name == "probit"
    assert pod_curve(wide, n * expit(14 * (wide - 0.4)), n).link.name == "logit"


def test_a90_95_is_above_the_true_a90_nineteen_times_in_twenty():
    stream, true = np.random.default_rng(8), (logit(0.9) + 6) / 20
    tries = [pod_curve(A, *drawn(stream, specimens=40, per_level=10)).severity_bound(0.9) for _ in range(300)]
    # Four standard deviations of a share of 300, and what is left of the sample's finiteness.
    assert np.mean(np.array(tries) > true) == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / 300))


@pytest.mark.parametrize("shares", [[0, 0, 0, 1, 1], [0, 0, 0.5, 1, 1], [1] * 5, [0] * 5, [0.9, 0.7, 0.5, 0.3, 0.1]])
def test_hits_that_determine_no_rising_curve_have_none(shares):
    rows = np.full((4, 5), 10.0)
    assert pod_curve(A, rows * shares, rows) is None


def by_loss(score, rows, **options):
    return detection_by_loss(score, rows, Specimens(rows["specimen"]), **options)


def of_losses(stream, *, shift=0.0):
    """4000 healthy rows and 2000 damaged ones whose scores grow with the loss."""
    loss = np.concatenate([np.zeros(4000), np.tile(A, 400)])
    rows = frame(4000, 2000, specimens=25, stiffness_loss=loss, phase_shift_deg=shift)
    return 20 * loss + stream.logistic(size=6000), rows


def test_a90_of_logistic_scores():
    """Scores of logistic noise around 20 a: POD(a) = 1 / (1 + exp(t - 20 a)) with the threshold t = logit(1 - 1e-3)."""
    score, rows = of_losses(np.random.default_rng(9))
    found = by_loss(score, rows)
    expected = (logit(1 - 1e-3) + logit(0.9)) / 20
    assert found.a90.low < expected < found.a90.high
    assert found.a90.value == pytest.approx(expected, abs=0.05)
    assert found.a90_95.value > found.a90.value
    assert found.levels["rows"].tolist() == [400] * 5
    threshold = least_threshold(score[:4000], 1e-3)
    shares = [(score[rows["stiffness_loss"] == a] > threshold).mean() for a in A]
    np.testing.assert_allclose(found.levels["detected"], shares, rtol=1e-12)


def test_a90_counts_damage_by_loss_alone_where_there_is_such():
    stream = np.random.default_rng(10)
    score, rows = of_losses(stream)
    shifted = rows[rows["tooth"] > 0].assign(phase_shift_deg=3.0)
    both = pd.concat([rows, shifted], ignore_index=True)
    levels = by_loss(np.append(score, np.full(2000, 99.0)), both).levels
    pd.testing.assert_frame_equal(levels, by_loss(score, rows).levels)
    only_shifted = rows.assign(phase_shift_deg=np.where(rows["tooth"] > 0, 3.0, 0.0))
    pd.testing.assert_frame_equal(by_loss(score, only_shifted).levels, levels)


def test_a90_is_not_extrapolated_nor_given_for_too_few_healthy_rows():
    score, rows = of_losses(np.random.default_rng(11))
    weak = (rows["stiffness_loss"] <= 0.3).to_numpy()
    assert np.isnan(a90_estimates(score[weak], rows[weak], Specimens(rows["specimen"][weak]))["a90"].value)
    few = np.arange(len(rows)) >= 1001
    assert by_loss(score[few], rows[few]) is None
    assert np.isnan(a90_estimates(score[few], rows[few], Specimens(rows["specimen"][few]))["a90_95"].value)
    assert by_loss(score[few], rows[few], rate=1e-2) is not None
