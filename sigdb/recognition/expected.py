"""What the Bayes rule loses on average, by Monte Carlo: rows with specimens and noise drawn anew from their law."""

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core.typing import FloatArray
from sigdb.recognition.bayes_rule import LOSSES, judge
from sigdb.recognition.efficiency import ErrorCurve
from sigdb.recognition.rows_by_point import OperatingPoint

DECIBELS = np.arange(-3.0, 25.0, 1.5)
"""Levels of an error curve, dB above the rows' own noise."""

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

    Parameters
    ----------
    points
        As :func:`operating_points` gives them.
    decibels
        By how much the noise is raised, ascending.
    draws, seed
        Rows drawn at each level; the same ones at all.
    """
    points, levels = list(points), np.asarray(decibels, float)
    found = [expected_losses(points, "location", draws=draws, seed=seed, decibels=level)["error"] for level in levels]
    error, standard_error = np.array(found).T
    chance = judged_shares(points) @ [point.before.risk[0] for point in points]
    return ErrorCurve(decibels=levels, error=error, standard_error=standard_error, chance=float(chance))


def judged_shares(points: Sequence[OperatingPoint]) -> FloatArray:
    """(points,) share of each operating point among the rows asked for."""
    judged = np.array([point.rows["judged"].sum() for point in points], float)
    return judged / judged.sum()
