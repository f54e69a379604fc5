"""The error of the Bayes rule against noise, and the share of information that a model uses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import logit

from sigdb.core import FloatArray, plain_array

INFORMATION_RANGE = (0.05, 0.95)
"""Range of the bound's log loss, as a share of the entropy, in which an efficiency has a meaning."""

ERROR_RANGE = (0.02, 0.8)
"""Range of an error, as a share of the error by chance, in which the curve gives a loss in decibels."""


def in_range(error: float, chance: float) -> bool:
    """Return whether an error is between 0.02 and 0.8 of that by chance: below it saturates, above it is flat."""
    low, high = ERROR_RANGE
    return bool(low * chance <= error <= high * chance)


def eta_info(entropy: float, model: float, bayes: float) -> float:
    """Compute the share of the information about the answer that a model uses.

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
        NaN where CE_Bayes is not between 5 and 95 % of H: then there is hardly any information, or none to miss.

    Examples
    --------
    >>> eta_info(2.0, 1.25, 1.0)
    0.75
    """
    low, high = INFORMATION_RANGE
    return (entropy - model) / (entropy - bayes) if low * entropy <= bayes <= high * entropy else np.nan


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorCurve:
    """Bayes error against the level of the noise, with the specimens unchanged.

    Attributes
    ----------
    decibels
        (levels,) increase of the noise, dB, ascending.
    error, standard_error
        (levels,) error of the Bayes rule, which takes the level into account, and its Monte Carlo standard error.
    chance
        Error of the most frequent answer.
    """

    decibels: FloatArray
    error: FloatArray
    standard_error: FloatArray
    chance: float

    def loss_db(self, error: ArrayLike) -> FloatArray:
        """Compute the increase of the noise at which the Bayes rule errs as often as a model.

        3.01 dB is twice the noise variance: half of the revolutions are wasted. The curve is interpolated linearly
        between its levels, on the logit scale of the error.

        Parameters
        ----------
        error
            Errors of models, of any shape; below the curve's first level the loss is negative.

        Returns
        -------
        ndarray, dB
            NaN where the error is not between 0.02 and 0.8 of chance, or outside of the curve.
        """
        error = plain_array("loss_db", "error", error, float)
        low, high = (share * self.chance for share in ERROR_RANGE)
        level = self._level(error)
        return np.where((error >= low) & (error <= high) & np.isfinite(level), level, np.nan)

    @property
    def origin(self) -> float:
        """Error of the Bayes rule at the noise of the rows, the level 0."""
        return float(self.error[self.decibels == 0][0])

    def excess_db(self, excess: ArrayLike) -> FloatArray:
        """Compute the increase of the noise at which the Bayes rule has an excess of errors over those on the rows.

        Parameters
        ----------
        excess
            Share of errors of a model minus that of the Bayes rule on the same rows, of any shape.

        Returns
        -------
        ndarray, dB
            Infinite beyond an end of the curve. NaN where the error at the noise of the rows is not between 0.02 and
            0.8 of chance: fewer errors are too few to count, and near chance the curve is flat.
        """
        excess = plain_array("excess_db", "excess", excess, float)
        if not in_range(self.origin, self.chance):
            return np.full(excess.shape, np.nan)
        return self._level(self.origin + excess)

    def _level(self, error: FloatArray) -> FloatArray:
        """Return the level, dB, at which the curve has these errors; infinite beyond its ends."""
        # Monte Carlo may leave neighbours out of order by less than its standard error.
        rising = np.maximum.accumulate(self.error)
        kept = np.flatnonzero(np.diff(rising, prepend=-1.0) > 0)
        kept = kept[(rising[kept] > 0) & (rising[kept] < 1)]
        if not kept.size:
            return np.full(error.shape, np.nan)
        at = logit(np.clip(error, 0.0, 1.0))
        return np.interp(at, logit(rising[kept]), self.decibels[kept], left=-np.inf, right=np.inf)
