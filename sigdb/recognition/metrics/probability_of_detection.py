"""Probability of detection against severity: a90, the stiffness loss found with probability 0.9, and its bound."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import expit, logit
from scipy.stats import norm

from sigdb.core import FloatArray
from sigdb.recognition.metrics.detection import counts, is_resolved, thresholds
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens, interval

RATE = 1e-3
"""False-alarm rate at which a90 is given."""

_STEPS = 50
_LEAST_INFORMATION = 1e-3
"""On the slope, below which hits and misses are apart in severity: the likelihood has no maximum."""


@dataclass(frozen=True, kw_only=True)
class PodCurve:
    """A logistic curve of the probability of detection, ``POD(a) = 1 / (1 + exp(-(intercept + slope a)))``.

    Attributes
    ----------
    intercept, slope
        Of the log odds over the severity a.
    covariance
        (2, 2) of the two. Rows of a specimen count as dependent: it is the sandwich over specimens.

    References
    ----------
    MIL-HDBK-1823A, Nondestructive evaluation system reliability assessment, U.S. Department of Defense (2009),
    appendix G: hit/miss data, a90 and a90/95.
    """

    intercept: float
    slope: float
    covariance: FloatArray

    def probability(self, a: FloatArray) -> FloatArray:
        """Probability of detection at severities a."""
        return np.asarray(expit(self.intercept + self.slope * np.asarray(a)))

    def bound(self, a: FloatArray, *, confidence: float = 0.95) -> FloatArray:
        """Lower confidence bound (Wald) of the probability of detection at severities a."""
        x = np.stack([np.ones_like(a), a], axis=-1)
        error = np.sqrt(np.einsum("...i,ij,...j", x, self.covariance, x))
        return np.asarray(expit(self.intercept + self.slope * a - norm.ppf(confidence) * error))

    def severity(self, probability: float = 0.9) -> float:
        """Severity found with this probability: a90."""
        return float((logit(probability) - self.intercept) / self.slope)

    def severity_bound(self, probability: float = 0.9, *, confidence: float = 0.95) -> float:
        """Severity at which the lower confidence bound has this probability: a90/95; nan if it never has."""
        z, (intercept, slope), ((u, v), (_, w)) = norm.ppf(confidence), (self.intercept, self.slope), self.covariance
        # (excess + slope a)^2 = z^2 (u + 2 v a + w a^2), of which the root with the left side's base positive.
        excess = intercept - logit(probability)
        roots = np.roots([slope**2 - z**2 * w, 2 * (slope * excess - z**2 * v), excess**2 - z**2 * u])
        roots = np.real(roots[(np.imag(roots) == 0) & (np.real(excess + slope * roots) >= 0)])
        return float(roots.min()) if roots.size and slope**2 > z**2 * w else np.nan


def pod_curve(a: FloatArray, hits: FloatArray, rows: FloatArray) -> PodCurve | None:
    """The most likely curve, and its covariance.

    Parameters
    ----------
    a
        (levels,) severities.
    hits, rows
        (specimens, levels) number of rows found, and number of rows.

    Returns
    -------
    PodCurve or None
        None where the likelihood has no maximum: all found, none, or found and missed apart in severity; and where
        detection does not grow with severity.
    """
    intercept, slope = (one[0] for one in _fitted(a, hits.sum(axis=0)[None], rows.sum(axis=0)[None]))
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


def _fitted(a: FloatArray, hits: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Intercept and slope (resamples,) of hits and rows (resamples, levels) by Newton; nan without a maximum."""
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
        ``stiffness_loss``, ``rows``, ``found`` (share), ``low``, ``high`` of each level.
    curve
        The curve, None where there is none.
    a90, a90_95
        Severity found with probability 0.9; its 95 % bound.
    resampled
        (1 + resamples,) a90 of the rows, then of each resample of :class:`Specimens`; nan where there is none.
    """

    rate: float
    levels: pd.DataFrame
    curve: PodCurve | None
    a90: Estimate
    a90_95: Estimate
    resampled: FloatArray


def detection_by_loss(score: FloatArray, rows: pd.DataFrame, *, rate: float = RATE, seed: int = 0) -> Pod | None:
    """Detection against stiffness loss, of damage by loss alone where there is such.

    Only rows without a phase shift count where a database has any, since a shift is found by itself. The curve is
    linear in the loss. What lies outside the losses of the rows is not extrapolated: a90 is unknown there.

    Parameters
    ----------
    score
        (rows,) score of damage.
    rows
        ``tooth``, ``stiffness_loss``, ``phase_shift_deg`` and ``specimen`` of each row.
    rate
        False-alarm rate.
    seed
        Seed of the bootstrap.

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
    specimens = Specimens(rows["specimen"], seed=seed)
    threshold = thresholds(score, healthy, specimens, [rate])
    loss = rows["stiffness_loss"].to_numpy(float)
    a = np.unique(loss[lossy])
    at = [lossy & (loss == level) for level in a]
    hits = np.stack(
        [counts(score, specimens, threshold, one)[:, 0] for one in at], axis=-1
    )  # resample, specimen, level
    of_all = np.column_stack([np.bincount(specimens.index[one], minlength=specimens.count).astype(float) for one in at])
    hit, of = np.einsum("rsl,rs->rl", hits, specimens.weights), specimens.weights @ of_all
    return Pod(
        rate=rate,
        levels=_levels(a, hit, of),
        curve=(curve := pod_curve(a, hits[0], of_all)),
        a90=interval(resampled := _a90(a, hit, of, curve)),
        a90_95=_point(curve.severity_bound(), a) if curve else UNKNOWN,
        resampled=resampled,
    )


def _levels(a: FloatArray, hit: FloatArray, of: FloatArray) -> pd.DataFrame:
    with np.errstate(divide="ignore", invalid="ignore"):
        share = [interval(one) for one in (hit / of).T]
    return pd.DataFrame(
        {
            "stiffness_loss": a,
            "rows": of[0].astype(int),
            "found": [one.value for one in share],
            "low": [one.low for one in share],
            "high": [one.high for one in share],
        }
    )


def _a90(a: FloatArray, hit: FloatArray, of: FloatArray, curve: PodCurve | None) -> FloatArray:
    if curve is None or not a[0] <= curve.severity() <= a[-1]:
        return np.full(len(hit), np.nan)
    intercept, slope = _fitted(a, hit, of)
    return np.where(slope > 0, (logit(0.9) - intercept) / slope, np.nan)


def _point(value: float, a: FloatArray) -> Estimate:
    """A bound, which has no interval of its own; unknown outside the levels."""
    return Estimate(value=value, low=np.nan, high=np.nan) if a[0] <= value <= a[-1] else UNKNOWN


def pod_figures(score: FloatArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """``a90`` and ``a90_95`` at a false-alarm rate of 1e-3, unknown where the rows do not tell."""
    pod = detection_by_loss(score, rows, seed=seed)
    return {"a90": pod.a90 if pod else UNKNOWN, "a90_95": pod.a90_95 if pod else UNKNOWN}
