"""Detection at low false-alarm rates, from a score of damage."""

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens
from sigdb.recognition.metrics.metric import Kind, Metric

RATES = (1e-2, 1e-3, 1e-4)
"""False-alarm rates at which the probability of detection is estimated."""

NEEDED = 3.0
"""Healthy rows that resolve a rate, times the rate: a rate needs 3 / rate of them."""


def rate_name(rate: float) -> str:
    """Return the name of the probability of detection at a rate, such as ``pd_at_1e-3``."""
    return f"pd_at_1e{round(np.log10(rate))}"


CALL_METRICS = (
    Metric(name="p_detected", title="P(detected)", better=1),
    Metric(name="false_alarm_rate", title="false-alarm rate", better=-1),
)
"""Metrics of the answers of a detector."""

RATE_METRICS = tuple(
    Metric(
        name=rate_name(rate),
        title=f"P(detected) at 1e{round(np.log10(rate))} false alarms",
        kind=Kind.QUOTIENT,
        better=1,
        bounded=True,
        share=True,
    )
    for rate in RATES
)
"""Probability of detection at the rates of :data:`RATES`."""


def call_values(called: IntArray, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Return the value of each row by metric of a detector; NaN where a row does not count.

    Parameters
    ----------
    called
        (rows,) 0 for none, anything else for damage.
    rows
        ``tooth`` of each row.
    """
    damaged, alarm = rows["tooth"].to_numpy() > 0, np.asarray(called) > 0
    return {
        "false_alarm_rate": np.where(damaged, np.nan, alarm),
        "p_detected": np.where(damaged, alarm, np.nan),
    }


def detection_at_rates(score: FloatArray, healthy: BoolArray, specimens: Specimens) -> dict[str, Estimate]:
    """Estimate the probability of detection at the rates of :data:`RATES`.

    It is unknown where healthy rows are too few for a rate.

    Parameters
    ----------
    score
        (rows,) score of damage, greater for more of it.
    healthy
        (rows,) whether a row is of a healthy gear.
    specimens
        Specimens of the rows.
    """
    resolved = [rate for rate in RATES if is_resolved(rate, int(healthy.sum()))]
    detected = dict.fromkeys(map(rate_name, RATES), UNKNOWN)
    if resolved and not healthy.all():
        share = detected_share(score, ~healthy, specimens, thresholds(score, healthy, specimens, resolved))
        detected |= {rate_name(rate): specimens.interval(share[:, i], within=(0, 1)) for i, rate in enumerate(resolved)}
    return detected


def is_resolved(rate: float, healthy: int) -> bool:
    """Return whether there are 3 / rate healthy rows."""
    return healthy >= NEEDED / rate * (1 - 1e-9)


def thresholds(score: FloatArray, healthy: BoolArray, specimens: Specimens, rates: list[float]) -> FloatArray:
    """Return the least thresholds (1 + resamples, rates) that at most a share ``rate`` of healthy rows exceeds."""
    order = np.argsort(-score[healthy])
    falling, owner = np.append(score[healthy][order], -np.inf), specimens.index[healthy][order]
    threshold = np.full((len(specimens.weights), len(rates)), np.nan)
    for i, weights in enumerate(specimens.weights):
        above = np.cumsum(weights[owner])
        if above[-1] > 0:
            place = np.searchsorted(above, np.asarray(rates) * above[-1] * (1 + 1e-12), side="right")
            threshold[i] = falling[place]
    return threshold


def counts(score: FloatArray, among: BoolArray, specimens: Specimens, threshold: FloatArray) -> FloatArray:
    """Count the rows of a mask above each threshold: (1 + resamples, rates, specimens)."""
    count = np.empty((*threshold.shape, specimens.count))
    for specimen in range(specimens.count):
        ascending = np.sort(score[among & (specimens.index == specimen)])
        count[..., specimen] = len(ascending) - np.searchsorted(ascending, threshold, side="right")
    return count


def detected_share(score: FloatArray, among: BoolArray, specimens: Specimens, threshold: FloatArray) -> FloatArray:
    """Return the share (1 + resamples, rates) of the rows of a mask whose score is above each threshold."""
    above = counts(score, among, specimens, threshold)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (above * specimens.weights[:, None]).sum(axis=-1) / specimens.totals(among.astype(float))[:, None]
    return np.where(np.isnan(threshold), np.nan, share)


def roc(score: FloatArray, healthy: BoolArray, specimens: Specimens, *, levels: int = 25) -> pd.DataFrame:
    """Compute the receiver operating characteristic, down to the least rate that the healthy rows resolve.

    Parameters
    ----------
    score, healthy, specimens
        As in :func:`detection_at_rates`.
    levels
        Number of rates.

    Returns
    -------
    pandas.DataFrame
        ``false_alarm_rate``, ``detected`` and the ends of its interval, ``low`` and ``high``.
    """
    if healthy.sum() <= NEEDED or healthy.all():
        return pd.DataFrame(columns=["false_alarm_rate", "detected", "low", "high"], dtype=float)
    rates = np.geomspace(NEEDED / healthy.sum(), 1.0, levels)
    share = detected_share(score, ~healthy, specimens, thresholds(score, healthy, specimens, list(rates)))
    detected = [specimens.interval(share[:, i], within=(0, 1)) for i in range(levels)]
    return pd.DataFrame(
        {
            "false_alarm_rate": rates,
            "detected": [estimate.value for estimate in detected],
            "low": [estimate.low for estimate in detected],
            "high": [estimate.high for estimate in detected],
        }
    )
