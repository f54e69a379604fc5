"""What the Bayes rule loses on average, by Monte Carlo: rows with specimens and noise drawn anew from their law."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray
from sigdb.recognition.bound.bayes_rule import LOSSES, judge
from sigdb.recognition.bound.error_curve import ErrorCurve, in_range
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.templates.posterior import Posterior

DECIBELS = np.array([-6, -3, -2, -1, -0.5, -0.25, 0, 0.25, 0.5, 1, 2, 3, 4.5, 6, 9, 12, 18, 24])
"""Levels of an error curve, dB above the rows' own noise: close to it a quarter of a decibel is to be resolved."""

_EXPECTED = {"error": "risk", "log_loss": "entropy"}
"""What the rule itself expects a loss to be: of the same mean over rows of the law, and less scatter."""


def expected_losses(
    points: Iterable[OperatingPoint],
    target: str,
    *,
    draws: int,
    seed: int = 0,
    specimens: bool = True,
    decibels: float = 0.0,
) -> dict[str, tuple[float, float]]:
    """Mean losses of the Bayes rule, with standard errors, over rows drawn anew from the law.

    Parameters
    ----------
    points
        As :func:`operating_points` gives them, for severity with ``damaged``. Each is drawn as often as it has rows
        that are asked for, and of each the cases of all its rows.
    target
        ``location`` or ``severity``.
    draws
        Number of rows.
    seed
        Of the draws. Calls with the same seed draw the same rows, specimens and noise, whatever the noise's level.
    specimens
        Whether gears have index errors (tier B2), or are nominal (B0); the rule knows which.
    decibels
        By how much the noise is raised; the rule knows it.

    Returns
    -------
    dict
        By loss, those of :class:`Bound`: mean and standard error.
    """
    points, stream = list(points), np.random.default_rng(seed)
    counts = stream.multinomial(draws, judged_shares(points))
    judged = pd.concat(
        judge(point, point.redrawn(stream, count, specimens=specimens, decibels=decibels), target)
        for point, count in zip(points, counts.tolist(), strict=True)
        if count
    )
    means = {name: judged[_EXPECTED.get(name, name)] for name in LOSSES[target]}
    return {name: (float(loss.mean()), float(loss.std() / np.sqrt(draws))) for name, loss in means.items()}


def error_curve(
    points: Iterable[OperatingPoint], decibels: ArrayLike = DECIBELS, *, draws: int = 2000, seed: int = 0
) -> ErrorCurve:
    """Error of the Bayes rule of location against the level of the noise, the specimens as they are.

    Rows are drawn as those asked for are distributed, and an answer counts with the probability that it is wrong, given
    the average and that distribution: of the same mean as counted errors, and less scatter.

    Parameters
    ----------
    points
        As :func:`operating_points` gives them.
    decibels
        By how much the noise is raised, ascending.
    draws, seed
        Rows drawn at each level; the same specimens and noise at all, so that the differences between levels are known
        far better than the levels.
    """
    points, levels = list(points), np.asarray(decibels, float)
    found = [expected_error(points, draws=draws, seed=seed, decibels=level) for level in levels]
    error, standard_error = np.array(found).T
    return ErrorCurve(decibels=levels, error=error, standard_error=standard_error, chance=chance_error(points))


def error_curve_around(
    points: Sequence[OperatingPoint], excess: Sequence[float], *, draws: int = 2000, seed: int = 0
) -> ErrorCurve:
    """An :func:`error_curve` that reaches from the rows' own noise as far as excesses of its error, and no further.

    Parameters
    ----------
    points, draws, seed
        As in :func:`error_curve`.
    excess
        Shares of errors beyond those of the Bayes rule, as :meth:`ErrorCurve.excess_db` is asked for.
    """
    found = {0.0: expected_error(points, draws=draws, seed=seed)}
    own, chance = found[0.0][0], chance_error(points)
    if in_range(own, chance):
        for sign, last in ((1, max(excess)), (-1, min(excess))):
            for level in sorted(sign * DECIBELS[sign * DECIBELS > 0]):
                found[sign * level] = expected_error(points, draws=draws, seed=seed, decibels=sign * level)
                if sign * (found[sign * level][0] - own - last) > 0:
                    break
    levels = np.array(sorted(found))
    error, standard_error = np.array([found[level] for level in levels]).T
    return ErrorCurve(decibels=levels, error=error, standard_error=standard_error, chance=chance)


def expected_error(
    points: Sequence[OperatingPoint], *, draws: int, seed: int = 0, decibels: float = 0.0
) -> tuple[float, float]:
    """Error of the Bayes rule of location at one level of an :func:`error_curve`, and its standard error."""
    stream = np.random.default_rng(seed)
    counts = stream.multinomial(draws, judged_shares(points))
    wrong = np.concatenate([_wrong(*one, stream, decibels) for one in zip(points, counts.tolist(), strict=True)])
    return float(wrong.mean()), float(wrong.std() / np.sqrt(draws))


def chance_error(points: Sequence[OperatingPoint]) -> float:
    """Error of the answer that is the most probable before an average is seen, on the rows asked for."""
    return float(judged_shares(points) @ [_risk(point.asked.before, point.before)[0] for point in points])


def _wrong(point: OperatingPoint, draws: int, stream: np.random.Generator, decibels: float) -> FloatArray:
    """(draws,) probability that the rule's answer is wrong."""
    wrong: list[FloatArray] = [np.empty(0)]
    for rows, x in point.asked.redrawn(stream, draws, decibels=decibels):
        likelihood = point.log_likelihood(x, rows)
        wrong.append(_risk(point.asked.known(likelihood), point.known(likelihood)))
    return np.concatenate(wrong)


def _risk(known: Posterior, rule: Posterior) -> FloatArray:
    """(rows,) probability, by what is known, that a rule's answer is wrong."""
    return -np.expm1(np.minimum(known.location[np.arange(len(rule.tooth)), rule.tooth], 0.0))


def judged_shares(points: Sequence[OperatingPoint]) -> FloatArray:
    """(points,) share of each operating point among the rows asked for."""
    judged = np.array([point.rows["judged"].sum() for point in points], float)
    return judged / judged.sum()
