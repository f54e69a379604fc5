"""Significance of a model's lead over the Bayes rule, which no honest model has."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import ndtr, stdtr, stdtrit

from sigdb.core import FloatArray, InputError, plain_array
from sigdb.recognition.metrics.estimate import Estimate, errors_to_end
from sigdb.recognition.metrics.metric import Metric


@dataclass(frozen=True, kw_only=True)
class Excess:
    """Lead of a model over the bound on the same rows.

    Attributes
    ----------
    value
        Mean of the bound's loss less the model's; below 0 the model is worse, as it must be.
    p_value
        Probability of such an excess or a greater one for a model that is as good as the bound; NaN for fewer than two
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
    """Test whether a model is significantly better than the Bayes rule, paired over the same rows.

    Rows of a specimen are no independent evidence. With D_s the sum of the gains of specimen s over its n_s rows, of S
    specimens, the mean gain and its error are::

        mean = sum D / sum n,   error^2 = S / (S - 1) sum (D_s - mean n_s)^2 / (sum n)^2,

    the linearised variance of a ratio. Their quotient is compared with Student's t with S - 1 degrees of freedom.
    Percentiles of a bootstrap would not do: those of five gains above 0, which chance gives once in 32 times, are above
    0 at every level. Where two rules differ in single rows, few specimens may agree by chance, as two that gain a row
    each. The mean is therefore compared with the normal law with the error of independent rows as well, and the greater
    probability counts.

    Parameters
    ----------
    model_losses, bound_losses
        (rows,) losses of a kind that the Bayes rule minimises: a column of
        :attr:`Bound.losses`, and the same loss of the model. For a hit rate, give the misses.
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
    columns = {"model_losses": model_losses, "bound_losses": bound_losses, "specimens": specimens}
    model, best, specimens = (plain_array("above_bound", name, values) for name, values in columns.items())
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
        of_specimens = stdtr(freedom, -np.divide(mean, error))
        of_rows = ndtr(-np.divide(mean * np.sqrt(len(gain)), gain.std(ddof=1)))
    p_value = float(max(of_specimens, of_rows))
    return Excess(value=mean, p_value=p_value, significant=p_value < 1 - level)


def _clustered(values: FloatArray, specimens: np.ndarray) -> tuple[float, float, int]:
    """Return the mean over rows, its standard error from the scatter between specimens, and the degrees of freedom."""
    names, index = np.unique(specimens, return_inverse=True)
    D, n, S = np.bincount(index, values), np.bincount(index), len(names)
    mean = D.sum() / n.sum()
    error = np.sqrt(S / max(1, S - 1) * ((D - mean * n) ** 2).sum()) / n.sum()
    return float(mean), float(error), S - 1


_CHANCE = 0.01
"""Greatest probability that a model as good as the bound counts as better in one metric or more."""


def metrics_above_bound(
    metrics: Iterable[Metric],
    model: Mapping[str, Estimate],
    bound: Mapping[str, Estimate],
    model_values: Mapping[str, FloatArray],
    bound_values: Mapping[str, FloatArray],
    rows: pd.DataFrame,
) -> tuple[str, ...]:
    """Return the names of the metrics that are better than the bound at a significance of 1 % for all together.

    Each of m bounded metrics is tested at 1 % / m (Bonferroni). Where both have values of rows, the test is that of the
    mean difference (:func:`above_bound`). Else the two estimates count as independent. Their standard errors follow
    from their intervals, and those of shares are at least those of independent rows. The law is Student's t with a
    degree of freedom less than there are specimens: one specimen shows nothing.

    Parameters
    ----------
    metrics
        Metrics of the target; those that the Bayes rule does not bound are left out.
    model, bound
        Estimates by metric.
    model_values, bound_values
        Values (rows,) by metric, for metrics that are their means.
    rows
        ``specimen`` and ``tooth`` of each row.
    """
    tested = [metric for metric in metrics if metric.bounded and metric.name in model.keys() & bound.keys()]
    level = 1 - _CHANCE / max(1, len(tested))
    above = []
    for metric in tested:
        name, estimates = metric.name, (model[metric.name], bound[metric.name])
        if name in model_values and name in bound_values:
            pair = (-metric.better * model_values[name], -metric.better * bound_values[name])
            better = _is_better(*pair, rows["specimen"].to_numpy(), level)
        else:
            gain = metric.better * (estimates[0].value - estimates[1].value)
            better = gain > _error(metric, *estimates, rows) * _quantile(level, rows)
        if better:
            above.append(name)
    return tuple(sorted(above))


def _is_better(model_losses: FloatArray, bound_losses: FloatArray, specimens: np.ndarray, level: float) -> bool:
    """Return whether the model is better on the rows that count for both."""
    counted = ~np.isnan(model_losses - bound_losses)
    if not counted.any():
        return False
    return above_bound(model_losses[counted], bound_losses[counted], specimens[counted], level=level).significant


def _error(metric: Metric, model: Estimate, bound: Estimate, rows: pd.DataFrame) -> float:
    """Return the standard error of the difference of two estimates."""
    S = rows["specimen"].nunique()
    error = np.hypot(model.high - model.low, bound.high - bound.low) / (2 * errors_to_end(S)) if S > 1 else 0.0
    if not metric.share:
        return float(error)
    n = int((rows["tooth"] > 0).sum())
    share = (n * bound.value + 2) / (n + 4)  # not quite 0 or 1 (Agresti and Coull)
    return float(max(error, np.sqrt(share * (1 - share) / (n + 4))))


def _quantile(level: float, rows: pd.DataFrame) -> float:
    """Return the quantile of Student's t; a bootstrap over S specimens has (S - 1) / S of the variance."""
    S = rows["specimen"].nunique()
    return float(np.sqrt(S / (S - 1)) * stdtrit(S - 1, level)) if S > 1 else np.inf
