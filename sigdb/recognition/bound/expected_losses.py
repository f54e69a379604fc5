"""Expected losses of the Bayes rule by Monte Carlo: rows with specimens and noise drawn anew from their law."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, plain_array
from sigdb.recognition.bound.bayes_rule import LOCATION_RULE, RULES, ClassRule, apply_rule
from sigdb.recognition.bound.error_curve import ErrorCurve, in_range
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.templates.posterior import Posterior

DECIBELS = np.array([-6, -3, -2, -1, -0.5, -0.25, 0, 0.25, 0.5, 1, 2, 3, 4.5, 6, 9, 12, 18, 24])
"""Levels of an error curve, dB above the noise of the rows; close to it they resolve a quarter of a decibel."""

_EXPECTED = {"error": "risk", "log_loss": "entropy"}
"""Column with the loss that the rule itself expects, of the same mean over rows of the law and less scatter."""


def expected_losses(
    points: Iterable[OperatingPoint],
    target: str,
    *,
    draws: int,
    seed: int = 0,
    specimens: bool = True,
    decibels: float = 0.0,
) -> dict[str, tuple[float, float]]:
    """Estimate mean losses of the Bayes rule, with standard errors, over rows drawn anew from the law.

    Parameters
    ----------
    points
        Operating points from :func:`operating_points`, for severity with ``damaged``. Each is drawn in proportion to
        its requested rows, with the cases of all its rows.
    target
        ``location``, ``kind`` or ``severity``.
    draws
        Number of rows.
    seed
        Seed of the draws. Calls with the same seed draw the same rows, specimens and noise at every level of the noise.
    specimens
        Whether gears have index errors (tier B2), or are nominal (B0); the rule takes this into account.
    decibels
        Increase of the noise, dB; the rule takes it into account.

    Returns
    -------
    dict
        Mean and standard error by loss; the losses are those of :class:`Bound`.
    """
    rule, points, stream = RULES[target], list(points), np.random.default_rng(seed)
    counts = stream.multinomial(draws, requested_shares(points))
    answers = pd.concat(
        apply_rule(rule, point, point.redrawn(stream, count, specimens=specimens, decibels=decibels))
        for point, count in zip(points, counts.tolist(), strict=True)
        if count
    )
    losses = {name: _EXPECTED.get(name, name) for name in rule.losses}
    means = {name: answers[loss] for name, loss in losses.items() if loss in answers}
    return {name: (float(loss.mean()), float(loss.std() / np.sqrt(loss.count()))) for name, loss in means.items()}


def error_curve(
    points: Iterable[OperatingPoint],
    decibels: ArrayLike = DECIBELS,
    *,
    draws: int = 2000,
    seed: int = 0,
    rule: ClassRule = LOCATION_RULE,
) -> ErrorCurve:
    """Compute the error of the Bayes rule of location against the level of the noise, with the specimens unchanged.

    Rows are drawn in the distribution of the requested ones. An answer counts with the probability that it is wrong,
    given the average and that distribution: of the same mean as counted errors, and less scatter.

    Parameters
    ----------
    points
        Operating points from :func:`operating_points`.
    decibels
        Increases of the noise, dB, ascending.
    draws, seed
        Rows drawn at each level. Specimens and noise are the same at all levels, so that the differences between levels
        are far more exact than the levels.
    rule
        Another rule that names classes.

    Returns
    -------
    ErrorCurve
        Error and standard error at each level.
    """
    points, levels = list(points), plain_array("expected_losses", "decibels", decibels, float)
    errors = [expected_error(points, draws=draws, seed=seed, decibels=level, rule=rule) for level in levels]
    error, standard_error = np.array(errors).T
    chance = chance_error(points, rule)
    return ErrorCurve(decibels=levels, error=error, standard_error=standard_error, chance=chance)


def error_curve_around(
    points: Sequence[OperatingPoint],
    excess: Sequence[float],
    *,
    draws: int = 2000,
    seed: int = 0,
    rule: ClassRule = LOCATION_RULE,
) -> ErrorCurve:
    """Compute an :func:`error_curve` that reaches from the noise of the rows as far as excesses of its error.

    Parameters
    ----------
    points, draws, seed, rule
        As in :func:`error_curve`.
    excess
        Shares of errors beyond those of the Bayes rule, as for :meth:`ErrorCurve.excess_db`.
    """
    errors = {0.0: expected_error(points, draws=draws, seed=seed, rule=rule)}
    origin, chance = errors[0.0][0], chance_error(points, rule)
    if in_range(origin, chance):
        for sign, last in ((1, max(excess)), (-1, min(excess))):
            for level in sorted(sign * DECIBELS[sign * DECIBELS > 0]):
                errors[sign * level] = expected_error(points, draws=draws, seed=seed, decibels=sign * level, rule=rule)
                if sign * (errors[sign * level][0] - origin - last) > 0:
                    break
    levels = np.array(sorted(errors))
    error, standard_error = np.array([errors[level] for level in levels]).T
    return ErrorCurve(decibels=levels, error=error, standard_error=standard_error, chance=chance)


def expected_error(
    points: Sequence[OperatingPoint],
    *,
    draws: int,
    seed: int = 0,
    decibels: float = 0.0,
    rule: ClassRule = LOCATION_RULE,
) -> tuple[float, float]:
    """Return the error of a Bayes rule at one level of an :func:`error_curve`, and its standard error."""
    stream = np.random.default_rng(seed)
    counts = stream.multinomial(draws, requested_shares(points))
    wrong = np.concatenate(
        [_wrong(point, count, stream, decibels, rule) for point, count in zip(points, counts.tolist(), strict=True)]
    )
    return float(wrong.mean()), float(wrong.std() / np.sqrt(draws))


def chance_error(points: Sequence[OperatingPoint], rule: ClassRule = LOCATION_RULE) -> float:
    """Return the error of the answer that is most probable before an average is seen, on the requested rows."""
    risks = [_risk(rule, point, point.requested.prior, point.prior)[0] for point in points]
    return float(requested_shares(points) @ risks)


def _wrong(
    point: OperatingPoint, draws: int, stream: np.random.Generator, decibels: float, rule: ClassRule
) -> FloatArray:
    """Return the probability (draws,) that the rule's answer is wrong."""
    wrong: list[FloatArray] = [np.empty(0)]
    for rows, x in point.requested.redrawn(stream, draws, decibels=decibels):
        likelihood = point.log_likelihood(x, rows)
        requested = point.requested.posterior_of(likelihood, rows)
        wrong.append(_risk(rule, point, requested, point.posterior_of(likelihood, rows)))
    return np.concatenate(wrong)


def _risk(rule: ClassRule, point: OperatingPoint, requested: Posterior, every: Posterior) -> FloatArray:
    """Return the probability (rows,), by the posterior of requested rows, that the answer by that of all is wrong."""
    answers = rule.log_probabilities(point, every).argmax(axis=1)
    return -np.expm1(np.minimum(rule.log_probabilities(point, requested)[np.arange(len(answers)), answers], 0.0))


def requested_shares(points: Sequence[OperatingPoint]) -> FloatArray:
    """Return the share (points,) of each operating point among the requested rows."""
    count = np.array([point.rows["requested"].sum() for point in points], float)
    return count / count.sum()
