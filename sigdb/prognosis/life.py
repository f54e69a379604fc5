"""The time until a severity reaches a limit, with its interval, where the looks do not contradict the growth law."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.prognosis.severity_filter import SeverityPosterior

_STEPS, _SHORTEST, _LONGEST = 8, 0.05, 10.0
"""Equal steps of time before their length doubles; the first over the mean of the shortest step of the growth, and the
last time over the longest mean life."""

_AGAINST = np.log(20.0)
"""Log evidence against growth of a kind from which it is contradicted: it is false once in 20 lives or more seldom."""


@dataclass(frozen=True, kw_only=True)
class RemainingLife:
    """Time until a severity reaches a limit.

    Attributes
    ----------
    low, median, high
        Median and ends of an interval, in the unit of time of the law; nan where no life is given, infinite where the
        limit is never reached.
    level
        Probability of the interval.
    reason
        Reason why no life is given; empty where one is.
    """

    low: float
    median: float
    high: float
    level: float
    reason: str = ""


def remaining_life(posterior: SeverityPosterior, *, limit: float, level: float = 0.9) -> RemainingLife:
    """Return the time until the severity reaches a limit, in an interval that holds beyond the prior of the law too.

    A prior decides as long as the looks say little. So the interval reaches from the lower to the higher of the ends by
    the law and by growth beyond its prior, :attr:`GrowthLaw.wider`, each with its posterior from the same looks. Both
    agree the more, the more the looks say. The law takes no part where growth beyond it has 20 times its evidence.

    No life is given without damage. None is given either where growth whose parameters change on the way has 20 times
    the evidence of both. Under either of them that ever happens with a probability of at most 1 / 20, by the inequality
    of Ville [1]_.

    A limit between two levels is reached by an interpolation over the logarithm of the severity.

    Parameters
    ----------
    posterior
        Posterior after the newest look.
    limit
        Severity, above the least level and at most the greatest.
    level
        Probability of the interval.

    Returns
    -------
    RemainingLife

    Raises
    ------
    InputError
        If the limit is beyond the levels.

    References
    ----------
    .. [1] J. Ville, Etude critique de la notion de collectif, Gauthier-Villars, 1939.
    """
    law = posterior.law
    if not law.levels[0] < limit <= law.levels[-1]:
        raise InputError(
            f"limit = {limit:g} is beyond the levels of {law.name}, which go from {law.levels[0]:.4g} to "
            f"{law.levels[-1]:.4g}"
        )
    if reason := _reason(posterior):
        return RemainingLife(low=np.nan, median=np.nan, high=np.nan, level=level, reason=reason)
    ends = [
        [_first(*_reached(each, limit), p) for p in ((1 - level) / 2, 0.5, (1 + level) / 2)]
        for each in _uncontradicted(posterior)
    ]
    low, medians, high = zip(*ends, strict=True)
    return RemainingLife(low=min(low), median=medians[0], high=max(high), level=level)


def _reason(posterior: SeverityPosterior) -> str:
    """Return why no life is given."""
    if not posterior.is_sure:
        return "damage is not sure enough"
    evidence = max(each.log_evidence for each in _uncontradicted(posterior))
    if posterior.log_evidence_of_change - evidence > _AGAINST:
        return f"the growth changes on the way: the looks contradict {posterior.law.name}, and growth beyond its prior"
    return ""


def _uncontradicted(posterior: SeverityPosterior) -> list[SeverityPosterior]:
    """Return the posteriors by the law and by growth beyond its prior, without the law where that contradicts it."""
    beyond = posterior.beyond
    if beyond is None:
        return [posterior]
    return [beyond] if beyond.log_evidence - posterior.log_evidence > _AGAINST else [posterior, beyond]


def _reached(posterior: SeverityPosterior, severity: float) -> tuple[FloatArray, FloatArray]:
    """Return times, and the probability that a severity is reached by then, given damage."""
    law = posterior.law
    limit = int(np.searchsorted(law.levels, severity))
    below, above = law.levels[limit - 1 : limit + 1]
    share = (law.levels >= severity).astype(float)
    share[limit - 1] = np.log(above / severity) / np.log(above / below)
    now = posterior.damaged.sum(axis=1)
    now /= now.sum()
    step, longest = _SHORTEST / law.step_rates.max(), _LONGEST * (1 / law.step_rates).sum(axis=1).max()
    transition = law.transition(step)
    times, reached = [0.0], [float((now @ share).sum())]
    while times[-1] < longest:
        for _ in range(_STEPS):
            now = np.matmul(now[:, None], transition)[:, 0]
            times.append(times[-1] + step)
            reached.append(float((now @ share).sum()))
        step, transition = 2 * step, transition @ transition
    return np.array(times), np.array(reached)


def _first(times: FloatArray, reached: FloatArray, p: float) -> float:
    """Return the time at which a probability is reached."""
    if reached[-1] < p:
        return float("inf")
    return float(np.interp(p, np.maximum.accumulate(reached), times))
