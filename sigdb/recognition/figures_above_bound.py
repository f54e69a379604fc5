"""Which figures of a model are significantly better than those of the Bayes rule, which none can be."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from scipy.stats import t as student

from sigdb.core.typing import FloatArray
from sigdb.recognition.bootstrap import Figure
from sigdb.recognition.excess import above_bound

BOUNDED = {"accuracy": 1, "pd_at": 1, "log_loss": -1, "brier": -1, "mae": -1, "rmse": -1, "crps": -1}
"""Figures, by the beginning of their name, that no rule can better than the bound: 1 where greater is better.

Others can be bettered at the cost of another: a rule that says 'none' of everything raises no false alarm.
"""

_CHANCE = 0.01
"""Probability, at most, that one figure or more of a model as good as the bound counts as better."""


def figures_above_bound(
    figures: Mapping[str, Figure],
    bound: Mapping[str, Figure],
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


def _error(name: str, one: Figure, other: Figure, rows: pd.DataFrame) -> float:
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
