"""Figures of merit, with intervals from a bootstrap over specimens."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.severity import TARGETS

_RESAMPLES = 1000


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of merit with the ends of its 95 % interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        if np.isnan(self.value):
            return "-"
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


def circular_distance(found: IntArray, true: IntArray, teeth: IntArray) -> IntArray:
    """Signed distance in teeth from the true to the found tooth, the short way around.

    Examples
    --------
    >>> import numpy as np
    >>> circular_distance(np.array([1, 12]), np.array([12, 1]), np.array([12, 12])).tolist()
    [1, -1]
    """
    half = teeth // 2
    return (found - true + half) % teeth - half


def location_figures(found: IntArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Figure]:
    """P(exact), P(within one tooth), P(detected), mean circular error of damaged rows; 'none' on healthy ones.

    Parameters
    ----------
    found
        (rows,) tooth found, 0 for none.
    rows
        ``tooth``, ``teeth`` and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    true, teeth = rows["tooth"].to_numpy(int), rows["teeth"].to_numpy(int)
    damaged, called = true > 0, found > 0
    distance = circular_distance(found, true, teeth)
    both = damaged & called
    values = {
        "p_exact": np.where(damaged, found == true, np.nan),
        "p_within_one": np.where(damaged, called & (np.abs(distance) <= 1), np.nan),
        "p_detected": np.where(damaged, called, np.nan),
        "none_on_healthy": np.where(damaged, np.nan, ~called),
        "circular_bias": np.where(both, distance, np.nan),
    }
    return _bootstrapped(values, rows["specimen"].to_numpy(), seed)


def severity_figures(found: pd.DataFrame, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Figure]:
    """Mean absolute error of each target on damaged rows, and the coverage of its interval where there is one.

    Parameters
    ----------
    found
        Estimates as :meth:`SeverityRegressor.predict` returns them.
    rows
        True targets and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    values = {}
    for target in TARGETS:
        true = rows[target].to_numpy(float)
        values[f"mae_{target}"] = np.abs(found[target].to_numpy() - true)
        if f"{target}_low" in found:
            inside = (found[f"{target}_low"].to_numpy() <= true) & (true <= found[f"{target}_high"].to_numpy())
            values[f"coverage_{target}"] = inside.astype(float)
    return _bootstrapped(values, rows["specimen"].to_numpy(), seed)


def _bootstrapped(values: Mapping[str, FloatArray], specimens: IntArray, seed: int) -> dict[str, Figure]:
    """Mean of each value without nan, with the 2.5 and 97.5 percentiles over resampled specimens."""
    names, index = np.unique(specimens, return_inverse=True)
    weights = np.random.default_rng(seed).multinomial(len(names), np.full(len(names), 1 / len(names)), _RESAMPLES)
    return {name: _figure(np.asarray(value, float), index, len(names), weights) for name, value in values.items()}


def _figure(value: FloatArray, index: IntArray, count: int, weights: IntArray) -> Figure:
    known = ~np.isnan(value)
    if not known.any():
        return Figure(value=np.nan, low=np.nan, high=np.nan)
    sums = np.bincount(index[known], value[known], count)
    numbers = np.bincount(index[known], minlength=count)
    total = weights @ numbers
    means = (weights @ sums)[total > 0] / total[total > 0]
    low, high = np.quantile(means, [0.025, 0.975])
    return Figure(value=float(value[known].mean()), low=float(low), high=float(high))


FIGURES: dict[str, Callable[..., dict[str, Figure]]] = {"location": location_figures, "severity": severity_figures}
"""Figures of merit by target."""
