"""Probability of detection against stiffness loss: a90, the loss detected with probability 0.9, and a90/95."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import expit, logit, ndtri

from sigdb.core import FloatArray
from sigdb.recognition.metrics.detection import counts, is_resolved, thresholds
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens
from sigdb.recognition.metrics.metric import Kind, Metric

RATE = 1e-3
"""False-alarm rate of a90."""

_STEPS = 50
_LEAST_INFORMATION = 1e-3
"""Least information on the slope. With less, hits and misses are apart in severity: the likelihood has no maximum."""

LOSS_COLUMNS = ("stiffness_loss", "phase_shift_deg")
"""Columns that detection by loss needs."""

A90_METRICS = (
    Metric(name="a90", title="a90, stiffness loss", kind=Kind.QUOTIENT, better=-1),
    Metric(name="a90_95", title="a90/95, stiffness loss", kind=Kind.QUOTIENT, better=-1),
)
"""Stiffness loss that is detected with probability 0.9, and its 95 % confidence bound."""


@dataclass(frozen=True, kw_only=True)
class PodCurve:
    """A logistic curve of the probability of detection, ``POD(a) = 1 / (1 + exp(-(intercept + slope a)))``.

    Attributes
    ----------
    intercept, slope
        Coefficients of the log odds over the severity a.
    covariance
        (2, 2) covariance of the two. Rows of a specimen count as dependent: it is the sandwich over specimens.

    References
    ----------
    MIL-HDBK-1823A, Nondestructive evaluation system reliability assessment, U.S. Department of Defense (2009),
    appendix G: hit/miss data, a90 and a90/95.
    """

    intercept: float
    slope: float
    covariance: FloatArray

    def probability(self, a: FloatArray) -> FloatArray:
        """Return the probability of detection at severities a."""
        return np.asarray(expit(self.intercept + self.slope * np.asarray(a)))

    def bound(self, a: FloatArray, *, confidence: float = 0.95) -> FloatArray:
        """Return the lower confidence bound (Wald) of the probability of detection at severities a."""
        x = np.stack([np.ones_like(a), a], axis=-1)
        error = np.sqrt(np.einsum("...i,ij,...j", x, self.covariance, x))
        return np.asarray(expit(self.intercept + self.slope * a - ndtri(confidence) * error))

    def severity(self, probability: float = 0.9) -> float:
        """Return the severity that is detected with this probability: a90."""
        return float((logit(probability) - self.intercept) / self.slope)

    def severity_bound(self, probability: float = 0.9, *, confidence: float = 0.95) -> float:
        """Return the severity at which the lower confidence bound has this probability: a90/95; NaN if it never has."""
        z, (intercept, slope), ((u, v), (_, w)) = ndtri(confidence), (self.intercept, self.slope), self.covariance
        # (excess + slope a)^2 = z^2 (u + 2 v a + w a^2), of which the root with the left side's base positive.
        excess = intercept - logit(probability)
        roots = np.roots([slope**2 - z**2 * w, 2 * (slope * excess - z**2 * v), excess**2 - z**2 * u])
        roots = np.real(roots[(np.imag(roots) == 0) & (np.real(excess + slope * roots) >= 0)])
        return float(roots.min()) if roots.size and slope**2 > z**2 * w else np.nan


def pod_curve(a: FloatArray, hits: FloatArray, rows: FloatArray) -> PodCurve | None:
    """Fit the most likely curve, and its covariance.

    Parameters
    ----------
    a
        (levels,) severities.
    hits, rows
        (specimens, levels) number of detected rows, and number of rows.

    Returns
    -------
    PodCurve or None
        None where the likelihood has no maximum: all rows are detected, none, or detected and missed rows are apart in
        severity. Also None where detection does not grow with severity.
    """
    intercept, slope = (fitted[0] for fitted in _fit(a, hits.sum(axis=0)[None], rows.sum(axis=0)[None]))
    if not slope > 0:
        return None
    x, p = np.column_stack([np.ones_like(a), a]), expit(intercept + slope * a)
    information = np.einsum("l,li,lj", rows.sum(axis=0) * p * (1 - p), x, x)
    score = (hits - rows * p) @ x
    inverse = np.linalg.inv(information)
    few = len(hits) / max(1, len(hits) - 1)
    return PodCurve(
        intercept=float(intercept), slope=float(slope), covariance=few * inverse @ (score.T @ score) @ inverse
    )


def _fit(a: FloatArray, hits: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fit intercept and slope (resamples,) to hits and rows (resamples, levels) by Newton; NaN without a maximum."""
    with np.errstate(divide="ignore", invalid="ignore"):
        centre, scale = a.mean(), a.std()
        x = np.column_stack([np.ones_like(a), (a - centre) / scale])
        b = np.zeros((len(hits), 2))
        for _ in range(_STEPS):
            p = expit(b @ x.T)
            u, v, w = ((rows * p * (1 - p)) @ x[:, 1] ** k for k in range(3))
            g = (hits - rows * p) @ x
            step = np.column_stack([w * g[:, 0] - v * g[:, 1], u * g[:, 1] - v * g[:, 0]]) / (u * w - v**2)[:, None]
            b = b + np.clip(step, -2, 2)
        b[~((np.abs(step).max(axis=1) < 1e-8) & (w - v**2 / u > _LEAST_INFORMATION))] = np.nan
    slope = b[:, 1] / scale
    return b[:, 0] - slope * centre, slope


@dataclass(frozen=True, kw_only=True)
class Pod:
    """Detection against stiffness loss at one false-alarm rate.

    Attributes
    ----------
    rate
        False-alarm rate.
    levels
        ``stiffness_loss``, ``rows``, ``detected`` (share), ``low``, ``high`` of each level.
    curve
        Fitted curve; None where there is none.
    a90, a90_95
        Loss that is detected with probability 0.9; its 95 % bound.
    resampled
        (1 + resamples,) a90 of the rows, then of each resample of :class:`Specimens`; NaN where there is none.
    """

    rate: float
    levels: pd.DataFrame
    curve: PodCurve | None
    a90: Estimate
    a90_95: Estimate
    resampled: FloatArray


def detection_by_loss(score: FloatArray, rows: pd.DataFrame, specimens: Specimens, *, rate: float = RATE) -> Pod | None:
    """Fit detection against stiffness loss, to damage by loss alone where there is such.

    Only rows without a phase shift count where a database has any, since a shift is detected by itself. The curve is
    linear in the loss. a90 is not extrapolated: outside the losses of the rows it is unknown.

    Parameters
    ----------
    score
        (rows,) score of damage.
    rows
        ``tooth``, ``stiffness_loss`` and ``phase_shift_deg`` of each row.
    specimens
        Specimens of the rows.
    rate
        False-alarm rate.

    Returns
    -------
    Pod or None
        None where the healthy rows do not resolve the rate, or there is no damaged row with a loss.
    """
    healthy = (rows["tooth"] == 0).to_numpy()
    lossy = (rows["stiffness_loss"] > 0).to_numpy() & ~healthy
    alone = lossy & (rows["phase_shift_deg"] == 0).to_numpy()
    lossy = alone if alone.any() else lossy
    if not is_resolved(rate, int(healthy.sum())) or not lossy.any():
        return None
    threshold = thresholds(score, healthy, specimens, [rate])
    loss = rows["stiffness_loss"].to_numpy(float)
    a = np.unique(loss[lossy])
    at = [lossy & (loss == level) for level in a]
    hits = np.stack(
        [counts(score, inside, specimens, threshold)[:, 0] for inside in at], axis=-1
    )  # resample, specimen, level
    total = np.column_stack(
        [np.bincount(specimens.index[inside], minlength=specimens.count).astype(float) for inside in at]
    )
    hit, of = np.einsum("rsl,rs->rl", hits, specimens.weights), specimens.weights @ total
    return Pod(
        rate=rate,
        levels=_levels(a, hit, of, specimens),
        curve=(curve := pod_curve(a, hits[0], total)),
        a90=specimens.interval(resampled := _a90(a, hit, of, curve), within=(0, np.inf)),
        a90_95=_within(curve.severity_bound(), a) if curve else UNKNOWN,
        resampled=resampled,
    )


def _levels(a: FloatArray, hit: FloatArray, of: FloatArray, specimens: Specimens) -> pd.DataFrame:
    with np.errstate(divide="ignore", invalid="ignore"):
        share = [specimens.interval(level, within=(0, 1)) for level in (hit / of).T]
    return pd.DataFrame(
        {
            "stiffness_loss": a,
            "rows": of[0].astype(int),
            "detected": [estimate.value for estimate in share],
            "low": [estimate.low for estimate in share],
            "high": [estimate.high for estimate in share],
        }
    )


def _a90(a: FloatArray, hit: FloatArray, of: FloatArray, curve: PodCurve | None) -> FloatArray:
    if curve is None or not a[0] <= curve.severity() <= a[-1]:
        return np.full(len(hit), np.nan)
    intercept, slope = _fit(a, hit, of)
    return np.where(slope > 0, (logit(0.9) - intercept) / slope, np.nan)


def _within(value: float, a: FloatArray) -> Estimate:
    """Return a bound, which has no interval of its own; unknown outside the levels."""
    return Estimate(value=value, low=np.nan, high=np.nan) if a[0] <= value <= a[-1] else UNKNOWN


def a90_estimates(score: FloatArray, rows: pd.DataFrame, specimens: Specimens) -> dict[str, Estimate]:
    """Estimate ``a90`` and ``a90_95`` at a false-alarm rate of 1e-3, unknown where the rows do not suffice."""
    pod = detection_by_loss(score, rows, specimens)
    return {"a90": pod.a90 if pod else UNKNOWN, "a90_95": pod.a90_95 if pod else UNKNOWN}
