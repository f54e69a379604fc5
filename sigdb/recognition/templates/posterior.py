"""Bayes' rule over the hypotheses of an operating point: which tooth, and how severe."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import log_softmax, logsumexp, softmax

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.metrics.location_and_severity import crps_sample


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Posterior probabilities of location and damage, given averages.

    Attributes
    ----------
    location
        (rows, teeth + 1) logarithm of the probability of no damage, and of the first damaged tooth 1, 2, ...
    damage
        (rows, templates) logarithm of the probability of each template, but for a common term of each row; -inf for
        healthy ones.
    """

    location: FloatArray
    damage: FloatArray

    @property
    def tooth(self) -> IntArray:
        """(rows,) the most probable first damaged tooth, 0 for none: the rule with the fewest errors."""
        return self.location.argmax(axis=1)

    @property
    def risk(self) -> FloatArray:
        """(rows,) probability that the most probable answer is wrong."""
        return risk_of(self.location)

    @property
    def entropy(self) -> FloatArray:
        """(rows,) entropy of the location, nats: the log loss that the rule expects."""
        return entropy_of(self.location)

    @property
    def log_odds(self) -> FloatArray:
        """(rows,) logarithm of P(damage) / P(none)."""
        return logsumexp(self.location[:, 1:], axis=1) - self.location[:, 0]

    def log_classes(self, classes: IntArray) -> FloatArray:
        """Return the logarithm of the probability of no damage and of each class of damage, (rows, 1 + classes).

        Parameters
        ----------
        classes
            (templates,) class of the damage of each template, from 1; 0 for damage that changes nothing.
        """
        damage = self.damage - logsumexp(self.damage, axis=1, keepdims=True)
        some = logsumexp(self.location[:, 1:], axis=1)
        with np.errstate(divide="ignore"):
            parts = [logsumexp(damage[:, classes == k], axis=1) + some for k in range(int(classes.max()) + 1)]
        parts[0] = np.logaddexp(parts[0], self.location[:, 0])
        return np.column_stack(parts)

    def among(self, some: BoolArray) -> "Posterior":
        """Return the posterior given that the damage is of one of some templates, by a mask (templates,)."""
        return replace(self, damage=np.where(some, self.damage, -np.inf))

    @cached_property
    def severity(self) -> FloatArray:
        """(rows, templates) probability of each template given that there is damage."""
        return softmax(self.damage, axis=1)

    def mean(self, level: FloatArray) -> FloatArray:
        """Return the mean (rows,), given damage, of a quantity with the values ``level`` (templates,).

        It has the least mean square error.
        """
        return self.severity @ level

    def median(self, level: FloatArray) -> FloatArray:
        """Return the median (rows,) of a quantity. It has the least mean absolute error."""
        return self.quantile(level, 0.5)

    def quantile(self, level: FloatArray, p: float) -> FloatArray:
        """Return the p-quantile (rows,) of a quantity. It has the least pinball loss."""
        order = np.argsort(level)
        below = np.cumsum(self.severity[:, order], axis=1)
        return level[order][(below >= p).argmax(axis=1)]

    def crps(self, level: FloatArray, true: FloatArray) -> FloatArray:
        """Return the continuous ranked probability score (rows,) of a quantity against its true value."""
        return crps_sample(np.broadcast_to(level, self.severity.shape), true, self.severity)


@dataclass(frozen=True, kw_only=True, eq=False)
class QuantityPosterior:
    """The posterior of a quantity of severity, given damage that has it. All is nan where no template has it.

    Attributes
    ----------
    damage
        Posterior of averages, given such damage.
    level
        (templates,) values; 0 for other templates.
    exists
        Whether some template has the quantity.
    """

    damage: Posterior
    level: FloatArray
    exists: bool

    @property
    def mean(self) -> FloatArray:
        """(rows,) mean."""
        some = np.isfinite(self.damage.damage).any(axis=0)
        return self._or_nan(lambda: self.damage.mean(self.level).clip(*np.quantile(self.level[some], [0, 1])))

    @property
    def spread(self) -> FloatArray:
        """(rows,) standard deviation."""
        return np.sqrt(self._or_nan(lambda: self.damage.severity @ self.level**2 - self.mean**2).clip(min=0))

    def quantile(self, p: float) -> FloatArray:
        """Return the p-quantile, (rows,)."""
        return self._or_nan(lambda: self.damage.quantile(self.level, p))

    def crps(self, true: FloatArray) -> FloatArray:
        """Return the continuous ranked probability score (rows,) against true values; nan where these are."""
        return self._or_nan(lambda: self.damage.crps(self.level, true))

    def _or_nan(self, value: Callable[[], FloatArray]) -> FloatArray:
        return value() if self.exists else np.full(len(self.damage.location), np.nan)


def quantity_posterior(after: Posterior, level: FloatArray) -> QuantityPosterior:
    """Return the posterior of a quantity with the values ``level`` (templates,), nan where damage does not have it."""
    has = np.isfinite(level)
    some = after.among(has)
    exists = bool(np.isfinite(some.damage).any(axis=1).all()) if len(some.damage) else True
    return QuantityPosterior(damage=some, level=np.where(has, level, 0.0), exists=exists)


def risk_of(log_probabilities: FloatArray) -> FloatArray:
    """Return the probability (rows,) that the most probable class is wrong, from logarithms (rows, classes)."""
    top = log_probabilities.argmax(axis=1)[:, None]
    others = np.where(np.arange(log_probabilities.shape[1]) == top, -np.inf, log_probabilities)
    # The sum of the others, since 1 - max would be rounded.
    return np.exp(logsumexp(others, axis=1))


def entropy_of(log_probabilities: FloatArray) -> FloatArray:
    """Return the entropy (rows,) of classes, nats, from the logarithms (rows, classes) of their probabilities."""
    share = np.exp(log_probabilities)
    return -(share * np.where(share > 0, log_probabilities, 0.0)).sum(axis=1)


def posterior(log_likelihood: FloatArray, log_prior: FloatArray, healthy: BoolArray) -> Posterior:
    """The posterior of averages.

    Parameters
    ----------
    log_likelihood
        (rows, templates, teeth) of each template turned to each tooth.
    log_prior
        (templates, teeth); that of a healthy template is spread over the teeth.
    healthy
        (templates,) whether a template is of a healthy gear.
    """
    joint = log_likelihood + log_prior
    joint[:, healthy], none = -np.inf, _log_of_sum(joint[:, healthy].reshape(len(joint), -1), axis=1)[0]
    of_teeth, top, shares = _log_of_sum(joint, axis=1)
    highest = top.max(axis=1)
    # The exponentials of the teeth serve once more; a share of 0 is one below the least float.
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.exp(np.where(np.isfinite(highest)[:, None], top - highest[:, None], -np.inf))
        damage = np.log((shares @ scale[:, :, None])[:, :, 0]) + highest[:, None]
    lost = np.isneginf(damage) & ~healthy
    if lost.any():  # less than the least float of the most likely: the likeliest tooth stands for all
        damage[lost] = joint[lost].max(axis=1)
    return Posterior(location=log_softmax(np.column_stack([none, of_teeth]), axis=1), damage=damage)


def _log_of_sum(values: FloatArray, axis: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the logarithm of the sum of exponentials along an axis, the greatest values, and exponentials over these.

    It is quicker than SciPy's, which takes a mask of the greatest values for more digits.
    """
    if not values.shape[axis]:
        empty = np.full(values.shape[:axis] + values.shape[axis + 1 :], -np.inf)
        return empty, empty, values
    top = values.max(axis=axis)
    shifted = np.exp(values - np.expand_dims(np.where(np.isfinite(top), top, 0.0), axis))
    with np.errstate(divide="ignore"):
        return np.log(shifted.sum(axis=axis)) + top, top, shifted


def log_prior(place: IntArray, tooth: IntArray, healthy: BoolArray, teeth: int) -> FloatArray:
    """(templates, teeth) logarithm of the shares of rows, by template and tooth; healthy rows spread over the teeth.

    Parameters
    ----------
    place, tooth
        (rows,) template of each row, as a place among the hypotheses, and its first damaged tooth.
    healthy
        (templates,) whether a template is of a healthy gear.
    teeth
        Tooth count.
    """
    count = np.zeros((len(healthy), teeth))
    np.add.at(count, (place, np.maximum(tooth, 1) - 1), 1.0)
    count[healthy] = count[healthy].sum(axis=1, keepdims=True) / teeth
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(count / count.sum()))
