"""Probability of detection against stiffness loss: a90, the loss detected with probability 0.9, and a90/95."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import ndtri

from sigdb.core import BoolArray, FloatArray
from sigdb.recognition.metrics.detection import counts, is_resolved, thresholds
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens
from sigdb.recognition.metrics.metric import Kind, Metric
from sigdb.recognition.metrics.pod_curve import PodCurve, fit_curves, pod_curve

RATE = 1e-3
"""False-alarm rate of a90."""

LOSS_COLUMNS = ("stiffness_loss", "phase_shift_deg")
"""Columns that detection by loss needs."""

A90_METRICS = (
    Metric(name="a90", title="a90, stiffness loss", kind=Kind.QUOTIENT, better=-1),
    Metric(name="a90_95", title="a90/95, stiffness loss", kind=Kind.QUOTIENT, better=-1),
)
"""Stiffness loss that is detected with probability 0.9, and its 95 % confidence bound."""


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

    The bound a90/95 holds the uncertainty of the curve and that of the threshold, which follows from healthy rows of
    few specimens. With s the standard deviation of a90 over thresholds of resampled specimens, ``a90/95 - a90`` is the
    root of the sum of two squares: of what the curve alone gives, and of 1.645 s.

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
        a90_95=_within(_bound(curve, score, at, total, specimens, threshold), a) if curve else UNKNOWN,
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
    intercept, slope = fit_curves(curve.link, a, hit, of)
    return np.where(slope > 0, (curve.link.inverse(0.9) - intercept) / slope, np.nan)


def _bound(
    curve: PodCurve,
    score: FloatArray,
    at: list[BoolArray],
    total: FloatArray,
    specimens: Specimens,
    threshold: FloatArray,
) -> float:
    """Return the 95 % bound of a90 by the curve and by the thresholds (1 + resamples, 1) of resampled specimens."""
    hits = np.stack([counts(score, inside, specimens, threshold)[:, 0].sum(axis=-1) for inside in at], axis=-1)
    moved = _a90(curve.a, hits, np.broadcast_to(total.sum(axis=0), hits.shape), curve)[1:]
    spread = moved[np.isfinite(moved)].std() if np.isfinite(moved).any() else np.nan
    return float(curve.severity() + np.hypot(curve.severity_bound() - curve.severity(), ndtri(0.95) * spread))


def _within(value: float, a: FloatArray) -> Estimate:
    """Return a bound, which has no interval of its own; unknown outside the levels."""
    return Estimate(value=value, low=np.nan, high=np.nan) if a[0] <= value <= a[-1] else UNKNOWN


def a90_estimates(score: FloatArray, rows: pd.DataFrame, specimens: Specimens) -> dict[str, Estimate]:
    """Estimate ``a90`` and ``a90_95`` at a false-alarm rate of 1e-3, unknown where the rows do not suffice."""
    pod = detection_by_loss(score, rows, specimens)
    return {"a90": pod.a90 if pod else UNKNOWN, "a90_95": pod.a90_95 if pod else UNKNOWN}
