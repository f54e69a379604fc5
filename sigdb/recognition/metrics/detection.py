"""Detection at low false-alarm rates, from a score of damage."""

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens, interval

RATES = (1e-2, 1e-3, 1e-4)
"""False-alarm rates at which the probability of detection is given."""

NEEDED = 3.0
"""Healthy rows for each false alarm in so many: a rate is not resolved by fewer than 3 / rate of them."""


def detection_figures(score: FloatArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """Probability of detection at the false-alarm rates of :data:`RATES`, unknown where healthy rows are too few.

    Parameters
    ----------
    score
        (rows,) score of damage, greater for more of it.
    rows
        ``tooth`` and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    healthy = (rows["tooth"] == 0).to_numpy()
    resolved = [rate for rate in RATES if is_resolved(rate, int(healthy.sum()))]
    figures = dict.fromkeys(map(rate_name, RATES), UNKNOWN)
    if resolved and not healthy.all():
        specimens = Specimens(rows["specimen"], seed=seed)
        found = detected_rows(score, healthy, specimens, thresholds(score, healthy, specimens, resolved), ~healthy)
        figures |= {rate_name(rate): interval(found[:, i]) for i, rate in enumerate(resolved)}
    return figures


def called_values(found: IntArray, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Of each row, what the figures of a detector are means of; nan where a row does not count."""
    damaged, called = rows["tooth"].to_numpy() > 0, np.asarray(found) > 0
    return {
        "false_alarm_rate": np.where(damaged, np.nan, called),
        "p_detected": np.where(damaged, called, np.nan),
    }


def called_figures(found: IntArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """Share of healthy rows that are called damaged, and of damaged ones.

    Parameters
    ----------
    found
        (rows,) 0 for none, anything else for damage.
    rows
        ``tooth`` and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    specimens = Specimens(rows["specimen"], seed=seed)
    return {name: specimens.mean(value) for name, value in called_values(found, rows).items()}


def rate_name(rate: float) -> str:
    """Name of the figure at a rate, ``pd_at_1e-3``."""
    return f"pd_at_1e{round(np.log10(rate))}"


def is_resolved(rate: float, healthy: int) -> bool:
    """Whether there are 3 / rate healthy rows."""
    return healthy >= NEEDED / rate * (1 - 1e-9)


def thresholds(score: FloatArray, healthy: BoolArray, specimens: Specimens, rates: list[float]) -> FloatArray:
    """(1 + resamples, rates) the least threshold that at most a share ``rate`` of the healthy rows exceeds."""
    order = np.argsort(-score[healthy])
    falling, owner = np.append(score[healthy][order], -np.inf), specimens.index[healthy][order]
    found = np.full((len(specimens.weights), len(rates)), np.nan)
    for i, weights in enumerate(specimens.weights):
        above = np.cumsum(weights[owner])
        if above[-1] > 0:
            place = np.searchsorted(above, np.asarray(rates) * above[-1] * (1 + 1e-12), side="right")
            found[i] = falling[place]
    return found


def counts(score: FloatArray, specimens: Specimens, threshold: FloatArray, among: BoolArray) -> FloatArray:
    """(1 + resamples, rates, specimens) number of each specimen's rows, of those meant, above each threshold."""
    found = np.empty((*threshold.shape, specimens.count))
    for one in range(specimens.count):
        own = np.sort(score[among & (specimens.index == one)])
        found[..., one] = len(own) - np.searchsorted(own, threshold, side="right")
    return found


def detected_rows(
    score: FloatArray, healthy: BoolArray, specimens: Specimens, threshold: FloatArray, among: BoolArray
) -> FloatArray:
    """(1 + resamples, rates) share of the rows meant whose score is above each threshold."""
    above = counts(score, specimens, threshold, among)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (above * specimens.weights[:, None]).sum(axis=-1) / specimens.totals(among.astype(float))[:, None]
    return np.where(np.isnan(threshold), np.nan, share)


def roc(score: FloatArray, rows: pd.DataFrame, *, points: int = 25, seed: int = 0) -> pd.DataFrame:
    """Probability of detection against false-alarm rate, down to the least that the healthy rows resolve.

    Returns
    -------
    pandas.DataFrame
        ``false_alarm_rate``, ``detected`` and the ends of its interval, ``low`` and ``high``.
    """
    healthy = (rows["tooth"] == 0).to_numpy()
    if healthy.sum() <= NEEDED or healthy.all():
        return pd.DataFrame(columns=["false_alarm_rate", "detected", "low", "high"], dtype=float)
    rates = np.geomspace(NEEDED / healthy.sum(), 1.0, points)
    specimens = Specimens(rows["specimen"], seed=seed)
    share = detected_rows(score, healthy, specimens, thresholds(score, healthy, specimens, list(rates)), ~healthy)
    figures = [interval(share[:, i]) for i in range(points)]
    return pd.DataFrame(
        {
            "false_alarm_rate": rates,
            "detected": [one.value for one in figures],
            "low": [one.low for one in figures],
            "high": [one.high for one in figures],
        }
    )
