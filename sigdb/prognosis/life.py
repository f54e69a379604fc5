"""The time until a severity reaches a limit, with its interval, where the looks do not contradict the growth law."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.prognosis.severity_filter import SeverityPosterior

_STEPS, _DOUBLINGS, _SHORTEST = 8, 17, 1e-5
"""Equal steps of time before their length doubles, the number of lengths, and the first one over the longest life."""

_AGAINST = np.log(5.0)
"""Log evidence for growth beyond the prior of the law, over the law, from which no life is given."""

_MOST_AT_ENDS = 0.6
"""Greatest probability of the least and the greatest speeds, for a life."""


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
    """Return the time until the severity reaches a limit.

    No life is given without damage, or where growth beyond the prior of the law explains the looks better by a factor
    of 5. None is given where the speed lies at an end of its prior, which would decide then. Nor is one given before
    the damage has grown by as great a ratio as the limit is away: a law seen over so little does not say the rest.

    The looks may also be too few to contradict a wrong law, and then the prior decides. So growth beyond it, with its
    posterior, gives a life too. None is given where that ends before the interval with a probability above ``1 -
    level``, twice that of the law itself.

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
    """
    law = posterior.law
    if not law.levels[0] < limit <= law.levels[-1]:
        raise InputError(
            f"limit = {limit:g} is beyond the levels of {law.name}, which go from {law.levels[0]:.4g} to "
            f"{law.levels[-1]:.4g}"
        )
    times, reached = _reached(posterior, limit)
    low, median, high = (_first(times, reached, p) for p in ((1 - level) / 2, 0.5, (1 + level) / 2))
    if reason := _reason(posterior, limit, low=low, level=level):
        return RemainingLife(low=np.nan, median=np.nan, high=np.nan, level=level, reason=reason)
    return RemainingLife(low=low, median=median, high=high, level=level)


def _reason(posterior: SeverityPosterior, limit: float, *, low: float, level: float) -> str:
    """Return why no life is given."""
    if not posterior.is_sure:
        return "damage is not sure enough"
    law, beyond = posterior.law, posterior.beyond
    if beyond is not None and beyond.log_evidence - posterior.log_evidence > _AGAINST:
        return f"the looks contradict the growth law or its prior, {law.name}"
    if posterior.parameters[law.at_the_ends].sum() > _MOST_AT_ENDS:
        return f"the speed of growth lies at an end of the prior of {law.name}"
    severity = posterior.quantile(0.5)
    if severity / posterior.first_severity < limit / severity:
        return "the damage was not yet seen to grow as far as the limit is away"
    if beyond is not None and low > 0 and np.interp(low, *_reached(beyond, limit)) > 1 - level:
        return f"growth beyond the prior of {law.name} explains the looks as well, and ends before"
    return ""


def _reached(posterior: SeverityPosterior, severity: float) -> tuple[FloatArray, FloatArray]:
    """Return times, and the probability that a severity is reached by then, given damage."""
    law = posterior.law
    limit = int(np.searchsorted(law.levels, severity))
    now = posterior.damaged.sum(axis=1)
    now /= now.sum()
    step = _SHORTEST * float(np.max((1 / law.step_rates[:, :limit]).sum(axis=1)))
    transition = law.transition(step)
    times, reached = [0.0], [now[:, limit:].sum()]
    for _ in range(_DOUBLINGS):
        for _ in range(_STEPS):
            now = np.einsum("pl,plm->pm", now, transition)
            times.append(times[-1] + step)
            reached.append(now[:, limit:].sum())
        step, transition = 2 * step, transition @ transition
    return np.array(times), np.array(reached)


def _first(times: FloatArray, reached: FloatArray, p: float) -> float:
    """Return the time at which a probability is reached."""
    if reached[-1] < p:
        return float("inf")
    return float(np.interp(p, np.maximum.accumulate(reached), times))
