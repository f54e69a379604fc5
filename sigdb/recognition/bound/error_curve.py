"""How much of what an average tells a model uses, and how many decibels of noise it wastes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import logit

from sigdb.core import FloatArray

INFORMATION_RANGE = (0.05, 0.95)
"""Shares of the entropy between which the bound's log loss must lie for an efficiency to mean something."""

ERROR_RANGE = (0.02, 0.8)
"""Shares of the error by chance between which an error must lie for a loss in decibels to be told from the curve."""


def in_range(error: float, chance: float) -> bool:
    """Whether an error is between 0.02 and 0.8 of that by chance: below it saturates, above it hardly changes."""
    low, high = ERROR_RANGE
    return bool(low * chance <= error <= high * chance)


def eta_info(entropy: float, model: float, bayes: float) -> float:
    """Share of the information about the answer that a model uses.

    ``eta_info = (H - CE_model) / (H - CE_Bayes)``: 1 for the Bayes rule, 0 for the shares of the classes alone, below 0
    for probabilities that mislead.

    Parameters
    ----------
    entropy
        H, entropy of the answer before an average is seen.
    model, bayes
        Log loss (cross entropy) of the model and of the Bayes rule, in the unit of H.

    Returns
    -------
    float
        nan where CE_Bayes is not between 5 and 95 % of H: then there is nothing to know, or nothing to miss.

    Examples
    --------
    >>> eta_info(2.0, 1.25, 1.0)
    0.75
    """
    low, high = INFORMATION_RANGE
    return (entropy - model) / (entropy - bayes) if low * entropy <= bayes <= high * entropy else np.nan


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorCurve:
    """Bayes error against the level of the noise, the specimens as they are.

    Attributes
    ----------
    decibels
        (levels,) by how much the noise is raised, ascending.
    error, standard_error
        (levels,) error of the Bayes rule, which knows the level, and the standard error of its Monte Carlo.
    chance
        Error of the most frequent answer.
    """

    decibels: FloatArray
    error: FloatArray
    standard_error: FloatArray
    chance: float

    def loss_db(self, error: ArrayLike) -> FloatArray:
        """By how much the noise may grow until the Bayes rule errs as often as a model does.

        3.01 dB is twice the noise variance: half of the revolutions are wasted. The curve is read off by straight lines
        between its levels, on the logit scale of the error.

        Parameters
        ----------
        error
            Errors of models, of any shape; below the curve's first level the loss is negative.

        Returns
        -------
        ndarray, dB
            nan where the error is not between 0.02 and 0.8 of chance, or outside of the curve.
        """
        error = np.asarray(error, float)
        low, high = (share * self.chance for share in ERROR_RANGE)
        level = self._level(error)
        return np.where((error >= low) & (error <= high) & np.isfinite(level), level, np.nan)

    @property
    def own(self) -> float:
        """Error of the Bayes rule at the rows' own noise, the level 0."""
        return float(self.error[self.decibels == 0][0])

    def excess_db(self, excess: ArrayLike) -> FloatArray:
        """By how much the noise may grow until the Bayes rule has so many more errors than it has on the same rows.

        Parameters
        ----------
        excess
            Share of errors of a model less that of the Bayes rule, of any shape; what the rows have by chance cancels.

        Returns
        -------
        ndarray, dB
            Infinite beyond an end of the curve; nan where the error at the rows' own noise is not between 0.02 and 0.8
            of chance: fewer errors are too few to count, and near chance the curve is flat.
        """
        excess = np.asarray(excess, float)
        known = in_range(self.own, self.chance)
        return self._level(self.own + excess) if known else np.full(excess.shape, np.nan)

    def _level(self, error: FloatArray) -> FloatArray:
        """Decibels at which the curve has these errors, infinite beyond its ends."""
        # Monte Carlo may leave neighbours out of order by less than its standard error.
        rising = np.maximum.accumulate(self.error)
        kept = np.flatnonzero(np.diff(rising, prepend=-1.0) > 0)
        kept = kept[(rising[kept] > 0) & (rising[kept] < 1)]
        if not kept.size:
            return np.full(error.shape, np.nan)
        at = logit(np.clip(error, 0.0, 1.0))
        return np.interp(at, logit(rising[kept]), self.decibels[kept], left=-np.inf, right=np.inf)
