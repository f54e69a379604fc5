"""The Bayesian filter over tooth and severity: the forward recursion of a hidden Markov model."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.prognosis.growth_laws import GrowthLaw

_SURE = 0.9
"""Probability from which damage is sure."""

_CHANGE = 0.01
"""Probability that the parameters of growth that changes are drawn anew before a look; assumed."""

_GREATEST_LOG = 700.0
"""Logarithm of the greatest statistic, which a float holds."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SeverityPosterior:
    """Probabilities after some looks.

    Attributes
    ----------
    law
        The growth law.
    none
        Probability of no damage.
    damaged
        (P, Z, L) probability of each set of parameters, damaged tooth and level.
    looks
        Number of looks.
    initiation
        Probability that damage begins before a look.
    log_evidence
        Logarithm of the density of all looks under the law, over that without damage.
    beyond
        The posterior of the same looks under growth beyond the prior of the law, :attr:`GrowthLaw.wider`.
    log_evidence_of_change
        The same as ``log_evidence`` under growth whose parameters change on the way.
    """

    law: GrowthLaw
    none: float
    damaged: FloatArray
    looks: int
    initiation: float
    log_evidence: float
    beyond: "SeverityPosterior | None" = None
    log_evidence_of_change: float = -np.inf

    @property
    def is_sure(self) -> bool:
        """Whether damage has a probability of 0.9 or more."""
        return self.none <= 1 - _SURE

    @property
    def teeth(self) -> FloatArray:
        """(Z,) probability that each tooth is damaged."""
        return np.asarray(self.damaged.sum(axis=(0, 2)))

    @cached_property
    def severity(self) -> FloatArray:
        """(L,) probability of each level, given damage."""
        level = self.damaged.sum(axis=(0, 1))
        return np.asarray(level / level.sum())

    @property
    def parameters(self) -> FloatArray:
        """(P,) probability of each set of parameters, given damage."""
        weight = self.damaged.sum(axis=(1, 2))
        return np.asarray(weight / weight.sum())

    def quantile(self, p: float) -> float:
        """Return the p-quantile of the severity, given damage."""
        return float(self.law.levels[int(np.searchsorted(np.cumsum(self.severity), p * (1 - 1e-12)))])

    @property
    def change_statistic(self) -> float:
        """Sum over the looks k of the density of damage since look k, over that without damage.

        Look k counts with ``(1 - initiation)^(k - 1)``. So it is at most the statistic of Shiryaev and Roberts [1]_,
        whose mean without damage is the number of looks: an alarm above A is false once in A looks or more seldom.

        References
        ----------
        .. [1] M. Pollak, Optimal detection of a change in distribution, Annals of Statistics 13 (1985) 206-227.
        """
        log_odds = np.log(self.damaged.sum()) - np.log(max(self.none, np.finfo(float).tiny))
        scale = self.looks * np.log1p(-self.initiation) - np.log(self.initiation)
        return float(np.exp(min(log_odds + scale, _GREATEST_LOG)))


class SeverityFilter:
    """A filter of looks at a gear, whose damage may begin at any look, tooth and level, and then grows.

    Before look n the gear is undamaged, or tooth z is damaged to level l, with the parameters p of the law. Damage
    begins with the probability ``initiation`` at each look, at each tooth and level alike, since looks may be rare. The
    recursion is exact for this chain.

    Parameters
    ----------
    law
        The growth law.
    teeth
        Tooth count Z.
    initiation
        Probability that damage begins before a look.
    """

    def __init__(self, law: GrowthLaw, *, teeth: int, initiation: float) -> None:
        if not 0 < initiation < 1:
            raise InputError(f"initiation = {initiation:g} must be between 0 and 1")
        self._law, self._teeth = law, teeth
        self._chain, self._beyond = _Chain(law, teeth, initiation), _Chain(law.wider, teeth, initiation)
        self._changing = _Chain(law.wider, teeth, initiation, change=_CHANGE)

    def look(self, log_ratio: FloatArray, *, elapsed: float) -> SeverityPosterior:
        """Return the posterior after one more look.

        Parameters
        ----------
        log_ratio
            (Z, L) logarithm of the density of the look with each tooth damaged to each level, over that without damage.
        elapsed
            Time since the look before, in the unit of the law's rates; it does not matter for the first one.

        Raises
        ------
        InputError
            If the array has another shape, or the time is below 0.
        """
        shape = (self._teeth, len(self._law.levels))
        if log_ratio.shape != shape:
            raise InputError(f"log_ratio has the shape {log_ratio.shape}; give one of {shape}: teeth and levels")
        if elapsed < 0:
            raise InputError(f"elapsed = {elapsed:g} must be 0 or more; give the looks in the order of time")
        after = self._chain.step(log_ratio, elapsed)
        return replace(
            after,
            beyond=self._beyond.step(log_ratio, elapsed),
            log_evidence_of_change=self._changing.step(log_ratio, elapsed).log_evidence,
        )


class _Chain:
    """A forward recursion under one law, whose parameters are drawn anew before a look with a small probability."""

    def __init__(self, law: GrowthLaw, teeth: int, initiation: float, change: float = 0.0) -> None:
        self._law, self._initiation, self._change = law, initiation, change
        self._none, self._damaged = 1.0, np.zeros((len(law.weights), teeth, len(law.levels)))
        self._log_evidence, self._looks = 0.0, 0

    def step(self, log_ratio: FloatArray, elapsed: float) -> SeverityPosterior:
        """Predict by the time since the look before, and update by the look (Z, L)."""
        weights = self._law.weights[:, None, None]
        before = self._damaged
        if self._change:
            before = (1 - self._change) * before + self._change * weights * before.sum(axis=0)
        damaged = before @ self._law.transition(elapsed)
        damaged += self._none * self._initiation * weights / damaged[0].size
        none = self._none * (1 - self._initiation)
        greatest = max(float(log_ratio.max()), 0.0)
        damaged = damaged * np.exp(log_ratio - greatest)
        none *= float(np.exp(-greatest))
        total = none + float(damaged.sum())
        self._none, self._damaged = none / total, damaged / total
        self._log_evidence += greatest + float(np.log(total))
        self._looks += 1
        return SeverityPosterior(
            law=self._law,
            none=self._none,
            damaged=self._damaged,
            looks=self._looks,
            initiation=self._initiation,
            log_evidence=self._log_evidence,
        )
