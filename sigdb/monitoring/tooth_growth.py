"""Growth of a tooth's difference over the looks: the filter of a prognosis, its alarm, and the time until a limit."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from sigdb.core import BoolArray, FloatArray, Note
from sigdb.prognosis import (
    GrowthLaw,
    RemainingLife,
    SeverityFilter,
    archard_wear,
    joined_laws,
    paris_crack,
    remaining_life,
)

LEVELS = np.geomspace(0.5, 100.0, 16)
"""Severities: amplitude of the difference at the damaged tooth over that of the others, relative to healthy looks."""

_RATES, _EXPONENTS, _REFERENCE = np.geomspace(0.01, 10.0, 7), (2.0, 3.0, 4.0), 10.0
"""Prior of the growth: a severity of 10 comes in a thousand days, or looks, to one; exponents of steels."""

_HALF_STEP_DB = 10 * float(np.log10(LEVELS[1] / LEVELS[0]))
"""Half of the distance of two levels, by which an interval is wider than its levels, dB."""

_MOST_LOOKS = 500
"""Most looks of the filter, the newest ones: earlier ones are taken not to have begun a damage."""

_INITIATION = 1e-5
"""Probability that damage begins before a look; the alarm does not depend on it as long as it is small."""

_LEAST_DEVIATION = 0.1
"""Least deviation of the logarithm of a tooth's energy, where few looks scatter less by chance."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ToothGrowth:
    """Growth of a tooth's difference from the healthy looks.

    Attributes
    ----------
    statistic
        (L,) statistic of each look; without damage it exceeds A once in A looks or more seldom. After a look above the
        limit it begins anew, so that each alarm is one of its own.
    stands_out
        Whether the newest look is an alarm, or an earlier one was and damage is likelier than none.
    probability
        Probability of damage after the newest look.
    tooth, tooth_probability
        The likeliest tooth, from 1, and its probability.
    severity_db, low_db, high_db
        Difference at that tooth over that of the other teeth, relative to the healthy looks, dB: median and 90 %
        interval, given damage.
    life
        Time until the limit; None where no limit is stated.
    per
        Unit of that time, ``day`` or ``look``.
    """

    statistic: FloatArray
    stands_out: bool
    probability: float
    tooth: int
    tooth_probability: float
    severity_db: float
    low_db: float
    high_db: float
    life: RemainingLife | None
    per: str

    @property
    def notes(self) -> tuple[Note, ...]:
        """A note on the amplitude and the assumed prior behind the growth, where it stands out."""
        if not self.stands_out:
            return ()
        fastest, slowest = _REFERENCE / _RATES[-1], _REFERENCE / _RATES[0]
        text = (
            "The growth is that of an amplitude: the difference of a tooth over that of the other teeth. How it goes "
            "with the size of the damage is unknown. The prior of its growth is assumed: that of wear, or of a crack "
            f"with exponents of {_EXPONENTS[0]:g} to {_EXPONENTS[-1]:g}, with {_REFERENCE:g} times the amplitude in "
            f"{fastest:g} to {slowest:g} {self.per}s. A life is as doubtful as they are."
        )
        values: dict[str, float | int | str] = {
            "rate_min": float(_RATES[0]),
            "rate_max": float(_RATES[-1]),
            "reference": _REFERENCE,
            "exponent_min": _EXPONENTS[0],
            "exponent_max": _EXPONENTS[-1],
            "per": self.per,
        }
        return (Note(code="growth-of-amplitude", text=text, values=values),)


def tooth_growth(
    tooth_map: FloatArray,
    healthy: BoolArray,
    days: FloatArray | None,
    *,
    doubted: BoolArray,
    alarm: float = np.inf,
    limit_db: float | None = None,
) -> ToothGrowth:
    """Return the growth of a tooth's difference over looks.

    Parameters
    ----------
    tooth_map
        (L, Z) energy of the difference from the reference in each tooth pass.
    healthy
        (L,) whether each look is taken as healthy.
    days
        (L,) times of the looks, rising; None where they have no dates.
    doubted
        (L,) whether something else may explain the difference of a look, which then says nothing.
    alarm
        Limit of the statistic.
    limit_db
        Difference over that of the other teeth, dB, at which a life ends.
    """
    looks = len(tooth_map)
    newest = range(max(looks - _MOST_LOOKS, 0), looks)
    ratios = log_ratios(tooth_map[newest.start :], tooth_map[healthy])
    elapsed = np.ones(looks) if days is None else np.diff(days, prepend=days[0])
    law, teeth = _law(), tooth_map.shape[1]
    chain = since_alarm = SeverityFilter(law, teeth=teeth, initiation=_INITIATION)
    statistic = np.zeros(looks)
    for number, ratio in zip(newest, ratios, strict=True):
        # Two digits of a time suffice, and looks in even steps then share one transition.
        time = float(f"{max(elapsed[number], 0.0):.2g}")
        ratio = np.zeros_like(ratio) if doubted[number] else ratio
        after = chain.look(ratio, elapsed=time)
        of_alarm = after if since_alarm is chain else since_alarm.look(ratio, elapsed=time)
        statistic[number] = of_alarm.change_statistic
        if statistic[number] > alarm:
            since_alarm = SeverityFilter(law, teeth=teeth, initiation=_INITIATION)
    low, median, high = (20 * np.log10(after.quantile(p)) for p in (0.05, 0.5, 0.95))
    life = None if limit_db is None else remaining_life(after, limit=10 ** (limit_db / 20))
    alarms = statistic > alarm
    return ToothGrowth(
        statistic=statistic,
        stands_out=bool(alarms[-1] or (alarms.any() and after.none < 0.5)),
        probability=1 - after.none,
        tooth=1 + int(after.teeth.argmax()),
        tooth_probability=float(after.teeth.max()),
        severity_db=median,
        low_db=low - _HALF_STEP_DB,
        high_db=high + _HALF_STEP_DB,
        life=life,
        per="look" if days is None else "day",
    )


def log_ratios(tooth_map: FloatArray, healthy_map: FloatArray) -> FloatArray:
    """Return the logarithm of the density of each look with damage (L, Z, levels), over that without.

    The logarithm of a tooth's energy, less the median of the other teeth, has Student's law about its healthy mean. Its
    deviation is that of the healthy looks (B, Z), for all teeth together. A severity a raises it by ``log(1 + a^2)``.
    """
    y, healthy = _over_others(tooth_map), _over_others(healthy_map)
    looks = len(healthy)
    deviation = max(float(np.sqrt(healthy.var(axis=0, ddof=1).mean())), _LEAST_DEVIATION)
    residual = ((y - healthy.mean(axis=0)) / (deviation * np.sqrt(1 + 1 / looks)))[:, :, None]
    raised = residual - np.log1p(LEVELS**2) / (deviation * np.sqrt(1 + 1 / looks))
    freedom = looks - 1
    return np.asarray(0.5 * (freedom + 1) * (np.log1p(residual**2 / freedom) - np.log1p(raised**2 / freedom)))


def _over_others(tooth_map: FloatArray) -> FloatArray:
    """Return the logarithm of the energy of each tooth (L, Z), less the median of the other teeth."""
    y = np.log(np.maximum(tooth_map, np.finfo(float).tiny))
    others = [np.median(np.delete(y, tooth, axis=1), axis=1) for tooth in range(y.shape[1])]
    return np.asarray(y - np.stack(others, axis=1))


@cache
def _law() -> GrowthLaw:
    """Return the prior of the growth: a crack or wear."""
    crack = paris_crack(LEVELS, rates=_RATES, exponents=_EXPONENTS, reference=_REFERENCE)
    return joined_laws([archard_wear(LEVELS, rates=_RATES), crack])
