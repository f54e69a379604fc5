"""Alarms over time: limits that count the looks, the instant of a change, and the trend since."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import Answer, BoolArray, FloatArray

LEAST_HEALTHY = 5
"""Least number of healthy looks from which limits are estimated."""

_INDICATORS = 3
"""Numbers that may alarm, the health indicator, that of the strongest tooth and its growth: they share the rate."""


@dataclass(frozen=True, kw_only=True)
class ChangePoint:
    """The instant at which a series has changed.

    Attributes
    ----------
    look, low, high
        Number of the first look after the change, from 0, and the ends of an interval with a probability of 0.95.
    """

    look: int
    low: int
    high: int


@dataclass(frozen=True, kw_only=True)
class Trend:
    """Straight line through a series, in healthy deviations a day, or a look where there are no dates.

    Attributes
    ----------
    slope, low, high
        Slope, and its 95 % interval.
    per
        ``day`` or ``look``.
    """

    slope: float
    low: float
    high: float
    per: str


@dataclass(frozen=True, kw_only=True)
class LevelReference:
    """Comparison of the looks after a change of level with the first of them.

    Attributes
    ----------
    look
        Number of the first look after the change, from 0.
    looks
        Number of looks with which those after them are compared.
    limit
        Limit of the indicators in deviations of these looks.
    answer
        Answer at the newest look: what has changed since.
    """

    look: int
    looks: int
    limit: float
    answer: Answer


def alarm_limit(*, false_alarms_a_year: float, looks_a_year: float, healthy: int) -> float:
    """Return the limit in healthy deviations that gives a stated number of false alarms a year.

    Each look may alarm by two indicators and by the growth of a tooth, so each has the probability ``p = F / (3 N)`` at
    F false alarms and N looks a year. The mean and the deviation are estimated from B healthy looks: the limit is that
    of a prediction interval, ``t sqrt(1 + 1 / B)``, with the quantile t of Student's law with B - 1 degrees of freedom.

    Parameters
    ----------
    false_alarms_a_year, looks_a_year
        F and N.
    healthy
        B, two or more.

    Examples
    --------
    >>> round(alarm_limit(false_alarms_a_year=1.0, looks_a_year=365.0, healthy=20), 2)
    3.71
    """
    from scipy.special import stdtrit

    p = min(false_alarms_a_year / (_INDICATORS * looks_a_year), 0.5)
    return float(-stdtrit(healthy - 1, p) * np.sqrt(1 + 1 / healthy))


def growth_limit(*, false_alarms_a_year: float, looks_a_year: float) -> float:
    """Return the limit of the statistic of a growth, which is exceeded once in as many looks or more seldom.

    Examples
    --------
    >>> growth_limit(false_alarms_a_year=1.0, looks_a_year=365.0)
    1095.0
    """
    return max(_INDICATORS * looks_a_year / false_alarms_a_year, 2.0)


def standardised(values: FloatArray, healthy: BoolArray, *, least: float) -> FloatArray:
    """Return values in healthy deviations from the healthy mean.

    Parameters
    ----------
    values
        (L,) values.
    healthy
        (L,) whether each is of a healthy look.
    least
        Deviation that noise alone gives, which counts where the healthy looks scatter less by chance.
    """
    some = values[healthy]
    return np.asarray((values - some.mean()) / max(float(some.std(ddof=1)), least))


def change_point(values: FloatArray) -> ChangePoint | None:
    """Return the instant of a step of the mean of a series (L,) of unit deviation; None where a step is not likely.

    The likelihood of a step after look k, with a free mean after it and 0 before, is ``exp(n m^2 / 2)`` for the n
    values after it and their mean m. A step counts where it exceeds the series without one by a factor of 1000 for each
    of the L places.
    """
    L = len(values)
    if L < 2:
        return None
    n = np.arange(L, 0, -1)
    log_ratio = np.cumsum(values[::-1])[::-1] ** 2 / (2 * n)
    log_ratio[0] = -np.inf
    if log_ratio.max() < np.log(1000 * L):
        return None
    weight = np.exp(log_ratio - log_ratio.max())
    share = np.cumsum(weight) / weight.sum()
    low, high = (int(np.searchsorted(share, q)) for q in (0.025, 0.975))
    best = int(log_ratio.argmax())
    return ChangePoint(look=best, low=min(low, best), high=max(high, best))


def trend(days: FloatArray | None, values: FloatArray) -> Trend | None:
    """Return the straight line through a series; None for fewer than three looks or one instant."""
    from scipy.stats import linregress, t

    x = np.arange(len(values), dtype=float) if days is None else days
    if len(values) < 3 or np.ptp(x) == 0:
        return None
    line = linregress(x, values)
    half = float(t.isf(0.025, len(values) - 2) * line.stderr)
    slope = float(line.slope)
    return Trend(slope=slope, low=slope - half, high=slope + half, per="look" if days is None else "day")
