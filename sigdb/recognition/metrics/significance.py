"""Whether a model is significantly better than the Bayes rule, which it cannot be."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.stats import norm
from scipy.stats import t as student

from sigdb.core import FloatArray, InputError
from sigdb.recognition.metrics.estimate import Estimate


@dataclass(frozen=True, kw_only=True)
class Excess:
    """By how much a model is better than the bound on the same rows.

    Attributes
    ----------
    value
        Mean of the bound's loss less the model's; below 0 the model is worse, as it must be.
    p_value
        Probability of such an excess or a greater one for a model that is as good as the bound; nan for fewer than two
        specimens.
    significant
        Whether that is less than one minus the level: the model has seen what it should not (test rows, or their
        specimens), or the bound's law is not that of the rows.
    """

    value: float
    p_value: float
    significant: bool


def above_bound(
    model_losses: ArrayLike, bound_losses: ArrayLike, specimens: ArrayLike, *, level: float = 0.99
) -> Excess:
    """Whether a model is significantly better than the Bayes rule, paired over the same rows.

    Rows of a specimen are no independent evidence. With D_s the sum of the gains of specimen s over its n_s rows, of S
    specimens, the mean gain and its error are::

        mean = sum D / sum n,   error^2 = S / (S - 1) sum (D_s - mean n_s)^2 / (sum n)^2,

    the linearised variance of a ratio, and their quotient is held against Student's t with S - 1 degrees of freedom.
    Percentiles of a bootstrap would not do: those of five gains above 0, which chance gives once in 32 times, are above
    0 at every level. Where two rules differ in single rows, few specimens may agree by chance, as two that gain a row
    each: so the mean is held against the normal law with the error of independent rows as well, and the greater
    probability counts.

    Parameters
    ----------
    model_losses, bound_losses
        (rows,) losses, the less the better, of a kind that the Bayes rule makes least: a column of
        :attr:`Bound.losses`, and the same of the model. For a hit rate give the misses.
    specimens
        (rows,) specimen of each row.
    level
        Level of significance, one-sided.

    Returns
    -------
    Excess

    Raises
    ------
    InputError
        If the lengths differ, or there are no rows.

    References
    ----------
    Cochran, *Sampling Techniques*, 3rd ed., Wiley 1977, chapter 9A (clusters of unequal size).

    Examples
    --------
    >>> honest = above_bound([0.4, 0.2, 0.5, 0.1], [0.1, 0.2, 0.2, 0.0], [0, 1, 2, 3])
    >>> round(honest.value, 3), honest.significant
    (-0.175, False)
    """
    model, best, specimens = (np.asarray(one) for one in (model_losses, bound_losses, specimens))
    if not 0 < len(model) == len(best) == len(specimens):
        raise InputError(
            f"above_bound: {len(model)} losses of the model, {len(best)} of the bound, {len(specimens)} specimens; "
            "give those of the same rows, at least one"
        )
    gain = best.astype(float) - model.astype(float)
    mean, error, freedom = _clustered(gain, specimens)
    if freedom < 1:
        return Excess(value=mean, p_value=np.nan, significant=False)
    if mean == 0:
        return Excess(value=0.0, p_value=0.5, significant=False)
    with np.errstate(divide="ignore"):
        of_specimens = student.sf(np.divide(mean, error), freedom)
        of_rows = norm.sf(np.divide(mean * np.sqrt(len(gain)), gain.std(ddof=1)))
    p_value = float(max(of_specimens, of_rows))
    return Excess(value=mean, p_value=p_value, significant=p_value < 1 - level)


def _clustered(values: FloatArray, specimens: np.ndarray) -> tuple[float, float, int]:
    """Mean over rows, its standard error from the scatter between specimens, and the degrees of freedom."""
    names, index = np.unique(specimens, return_inverse=True)
    D, n, S = np.bincount(index, values), np.bincount(index), len(names)
    mean = D.sum() / n.sum()
    error = np.sqrt(S / max(1, S - 1) * ((D - mean * n) ** 2).sum()) / n.sum()
    return float(mean), float(error), S - 1


BOUNDED = {"accuracy": 1, "pd_at": 1, "log_loss": -1, "brier": -1, "mae": -1, "rmse": -1, "crps": -1}
"""Figures, by the beginning of their name, that no rule can better than the bound: 1 where greater is better.

Others can be bettered at the cost of another: a rule that says 'none' of everything raises no false alarm.
"""

_CHANCE = 0.01
"""Probability, at most, that one figure or more of a model as good as the bound counts as better."""


def figures_above_bound(
    figures: Mapping[str, Estimate],
    bound: Mapping[str, Estimate],
    values: Mapping[str, FloatArray],
    bound_values: Mapping[str, FloatArray],
    rows: pd.DataFrame,
) -> tuple[str, ...]:
    """Names of the figures that are better than the bound at a significance of 1 % for all of them together.

    Each of m figures is judged at 1 % / m (Bonferroni). Where the values of both are given row by row, by the mean of
    their difference (:func:`above_bound`). Else the two figures count as independent, with the standard errors that
    their intervals tell, of shares at least those of independent rows, and Student's t with a degree of freedom less
    than there are specimens: nothing is told by one.

    Parameters
    ----------
    figures, bound
        Of the model and of the Bayes rule, by name.
    values, bound_values
        By name (rows,), what figures are means of.
    rows
        ``specimen`` of each row, and ``tooth``; those of both.
    """
    judged = {name: sign for name in figures.keys() & bound.keys() if (sign := _sign(name))}
    level = 1 - _CHANCE / max(1, len(judged))
    found = []
    for name, sign in judged.items():
        if name in values and name in bound_values:
            known = ~np.isnan(values[name] - bound_values[name])
            ours, best = (-sign * some[name][known] for some in (values, bound_values))
            specimens = rows["specimen"].to_numpy()[known]
            better = known.any() and above_bound(ours, best, specimens, level=level).significant
        else:
            gain = sign * (figures[name].value - bound[name].value)
            better = gain > _error(name, figures[name], bound[name], rows) * _quantile(level, rows)
        if better:
            found.append(name)
    return tuple(sorted(found))


def _sign(name: str) -> int:
    return next((sign for start, sign in BOUNDED.items() if name.startswith(start)), 0)


def _error(name: str, one: Estimate, other: Estimate, rows: pd.DataFrame) -> float:
    """Standard error of the difference of two figures."""
    error = np.hypot(one.high - one.low, other.high - other.low) / (2 * 1.96)
    if not name.startswith("pd_at"):
        return float(error)
    n = int((rows["tooth"] > 0).sum())
    share = (n * other.value + 2) / (n + 4)  # not quite 0 or 1 (Agresti and Coull)
    return float(max(error, np.sqrt(share * (1 - share) / (n + 4))))


def _quantile(level: float, rows: pd.DataFrame) -> float:
    """Of Student's t; a bootstrap over S specimens has (S - 1) / S of the variance."""
    S = rows["specimen"].nunique()
    return float(np.sqrt(S / (S - 1)) * student.ppf(level, S - 1)) if S > 1 else np.inf
