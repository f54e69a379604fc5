"""Figures of merit with intervals from a bootstrap over specimens, all resamples at once."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, IntArray

RESAMPLES = 1000


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A figure of merit with the ends of its interval, 95 % unless said otherwise; nan where there is none."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        if np.isnan(self.value):
            return "-"
        if np.isnan(self.low):
            return f"{self.value:.3f}"
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


UNKNOWN = Estimate(value=np.nan, low=np.nan, high=np.nan)
"""A figure for which there are no rows, or too few."""


def columns_of(**figures: Estimate) -> dict[str, float]:
    """Figures as columns of a row of a table: ``NAME``, ``NAME_low`` and ``NAME_high``."""
    ends = {"": "value", "_low": "low", "_high": "high"}
    return {f"{name}{end}": getattr(one, part) for name, one in figures.items() for end, part in ends.items()}


class Specimens:
    """Specimens of rows, and how often each resample draws each.

    Rows of a specimen are no independent evidence, so specimens are drawn, with replacement, and bring all their rows.
    The same seed draws the same specimens: differences of figures of the same rows are paired.

    Attributes
    ----------
    index
        (rows,) number of each row's specimen.
    count
        Number of specimens.
    weights
        (1 + resamples, count) how often each specimen counts: the first row is all ones, the specimens as they are.
    """

    def __init__(self, specimens: ArrayLike, *, seed: int = 0) -> None:
        names, self.index = np.unique(np.asarray(specimens), return_inverse=True)
        self.count = len(names)
        equal = np.full(self.count, 1 / self.count)
        drawn = np.random.default_rng(seed).multinomial(self.count, equal, RESAMPLES)
        self.weights = np.vstack([np.ones((1, self.count)), drawn])

    def totals(self, values: FloatArray) -> FloatArray:
        """(1 + resamples, ...) sums of values (rows, ...) over the rows of each resample."""
        flat = values.reshape(len(values), -1)
        sums = np.column_stack([np.bincount(self.index, column.astype(float), self.count) for column in flat.T])
        return np.asarray((self.weights @ sums).reshape(len(self.weights), *values.shape[1:]), float)

    def figure(self, statistic: Callable[..., FloatArray], *values: FloatArray, level: float = 0.95) -> Estimate:
        """A statistic of sums over rows.

        Parameters
        ----------
        statistic
            From totals, each (1 + resamples, ...), to (1 + resamples,).
        values
            (rows, ...) each.
        level
            Of the interval.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            return interval(statistic(*(self.totals(np.asarray(one, float)) for one in values)), level=level)

    def mean(self, values: FloatArray, *, level: float = 0.95) -> Estimate:
        """Mean of the values (rows,) that are not nan."""
        return self.figure(np.divide, np.nan_to_num(values), ~np.isnan(values), level=level)

    def root_mean_square(self, values: FloatArray) -> Estimate:
        """Root mean square of the values (rows,) that are not nan."""
        return self.figure(lambda s, n: np.sqrt(s / n), np.nan_to_num(values) ** 2, ~np.isnan(values))


def interval(statistic: FloatArray, *, level: float = 0.95) -> Estimate:
    """The figure of a statistic (1 + resamples,): its first entry, and percentiles of the finite others."""
    value, resampled = float(statistic[0]), statistic[1:][np.isfinite(statistic[1:])]
    if not np.isfinite(value) or resampled.size == 0:
        return UNKNOWN
    low, high = np.quantile(resampled, [(1 - level) / 2, (1 + level) / 2])
    return Estimate(value=value, low=float(low), high=float(high))


def paired_difference(a: FloatArray, b: FloatArray, specimens: IntArray, *, level: float = 0.95) -> Estimate:
    """Mean of a - b over the same rows, those where neither is nan.

    Examples
    --------
    >>> import numpy as np
    >>> paired_difference(np.array([1.0, 1.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.arange(3)).value
    0.3333333333333333
    """
    return Specimens(specimens).mean(np.asarray(a, float) - np.asarray(b, float), level=level)
