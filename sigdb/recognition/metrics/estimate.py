"""Estimates with intervals from a bootstrap over specimens, or by Student's t where they are few."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtrit

from sigdb.core import BoolArray, FloatArray, IntArray, plain_array

RESAMPLES = 1000
"""Resamples of a bootstrap."""

FEW = 30
"""Number of specimens below which intervals are by Student's t: percentiles of resamples of fewer are too narrow."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """An estimated number with the ends of its confidence interval.

    Attributes
    ----------
    value
        The estimate; NaN where there is none.
    low, high
        Ends of the interval, at 95 % unless the text says otherwise; NaN where there is none, as of one specimen.
    """

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        if np.isnan(self.value):
            return "-"
        if np.isnan(self.low):
            return f"{self.value:.3f}"
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"

    def times(self, factor: float) -> Self:
        """Return the estimate in another unit."""
        ends = {"value": self.value, "low": self.low, "high": self.high}
        return self if factor == 1 else replace(self, **{name: factor * number for name, number in ends.items()})


UNKNOWN = Estimate(value=np.nan, low=np.nan, high=np.nan)
"""An estimate for which there are no rows, or too few."""

_ENDS = {"": "value", "_low": "low", "_high": "high"}


def columns_of(**estimates: Estimate) -> dict[str, float]:
    """Return estimates as columns of a row of a table: ``NAME``, ``NAME_low`` and ``NAME_high``."""
    return {
        f"{name}{suffix}": getattr(estimate, end)
        for name, estimate in estimates.items()
        for suffix, end in _ENDS.items()
    }


class Specimens:
    """The specimens of rows, with the number of times that each resample draws each of them.

    Rows of a specimen are no independent evidence, so specimens are drawn, with replacement, and bring all their rows.
    The same seed draws the same specimens: differences of metrics of the same rows are paired.

    Intervals hold percentiles of the resamples. Percentiles of S specimens, S < 30, are too narrow: the interval
    is then ``value +- t s sqrt(S / (S - 1))``, with s the standard deviation of the resamples and t the quantile of
    Student's t with S - 1 degrees of freedom. A bootstrap over S specimens has (S - 1) / S of the variance [1]_.

    Parameters
    ----------
    specimens
        (rows,) specimen of each row.
    seed
        Seed of the resamples.

    Attributes
    ----------
    index
        (rows,) number of each row's specimen.
    count
        Number of specimens.
    weights
        (1 + resamples, count) multiplicity of each specimen. The first row is all ones: the specimens as they are.

    References
    ----------
    .. [1] B. Efron, R. J. Tibshirani, *An Introduction to the Bootstrap*, Chapman and Hall 1993, chapters 5 and 12.
    """

    index: IntArray
    count: int
    weights: FloatArray

    def __init__(self, specimens: ArrayLike, *, seed: int = 0) -> None:
        names, self.index = np.unique(plain_array("Specimens", "specimens", specimens), return_inverse=True)
        self.seed = seed
        self._resample(len(names))

    def _resample(self, count: int) -> None:
        self.count = count
        drawn = np.random.default_rng(self.seed).multinomial(count, np.full(count, 1 / count), RESAMPLES)
        self.weights = np.vstack([np.ones((1, count)), drawn])

    def select(self, inside: BoolArray) -> Self:
        """Return the specimens of some rows. They are resampled anew only where a specimen loses all its rows."""
        selected = copy(self)
        names, selected.index = np.unique(self.index[inside], return_inverse=True)
        if len(names) < self.count:
            selected._resample(len(names))
        return selected

    def totals(self, values: FloatArray) -> FloatArray:
        """Return the sums (1 + resamples, ...) of values (rows, ...) over the rows of each resample."""
        flat = values.reshape(len(values), -1)
        sums = np.column_stack([np.bincount(self.index, column.astype(float), self.count) for column in flat.T])
        return np.asarray((self.weights @ sums).reshape(len(self.weights), *values.shape[1:]), float)

    def interval(
        self, statistic: FloatArray, *, level: float = 0.95, within: tuple[float, float] = (-np.inf, np.inf)
    ) -> Estimate:
        """Return the estimate of a statistic (1 + resamples,): its first entry, and an interval by the finite others.

        Parameters
        ----------
        statistic
            The statistic of the specimens as they are, then of each resample.
        level
            Level of the interval.
        within
            Least and greatest value that the statistic can have.
        """
        value, resampled = float(statistic[0]), statistic[1:][np.isfinite(statistic[1:])]
        if not np.isfinite(value) or resampled.size == 0:
            return UNKNOWN
        if self.count < 2:
            return Estimate(value=value, low=np.nan, high=np.nan)
        if self.count >= FEW:
            low, high = np.quantile(resampled, [(1 - level) / 2, (1 + level) / 2])
        else:
            half_width = resampled.std() * errors_to_end(self.count, level)
            low, high = np.clip([value - half_width, value + half_width], *within)
        return Estimate(value=value, low=float(low), high=float(high))

    def estimate(
        self,
        statistic: Callable[..., FloatArray],
        *values: FloatArray,
        level: float = 0.95,
        within: tuple[float, float] = (-np.inf, np.inf),
    ) -> Estimate:
        """Estimate a statistic of sums over rows.

        Parameters
        ----------
        statistic
            Function of totals, each (1 + resamples, ...), that returns (1 + resamples,).
        values
            (rows, ...) each.
        level
            Level of the interval.
        within
            Least and greatest value that the statistic can have.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            totals = [self.totals(np.asarray(summand, float)) for summand in values]
            return self.interval(statistic(*totals), level=level, within=within)

    def mean(self, values: FloatArray, *, level: float = 0.95, may_be_share: bool = True) -> Estimate:
        """Estimate the mean of the values (rows,) that are not NaN.

        The interval of a share, a mean of 0 and 1, holds that of as many independent rows [1]_: where all specimens
        agree, as with no miss in any of them, the scatter between them says nothing.

        Parameters
        ----------
        values
            (rows,) values.
        level
            Level of the interval.
        may_be_share
            Whether values that are all 0 or 1 are hits and misses; differences are not.

        References
        ----------
        .. [1] E. B. Wilson, "Probable inference, the law of succession, and statistical inference", Journal of the
               American Statistical Association 22 (1927) 209-212, doi:10.1080/01621459.1927.10502953.
        """
        counted = values[~np.isnan(values)]
        is_share = may_be_share and bool(np.isin(counted, (0, 1)).all())
        within = 0.0 if (counted >= 0).all() else -np.inf, 1.0 if is_share else np.inf
        estimate = self.estimate(np.divide, np.nan_to_num(values), ~np.isnan(values), level=level, within=within)
        if not is_share or not np.isfinite(estimate.low):
            return estimate
        low, high = independent_share(counted.sum(), counted.size, level)
        return Estimate(value=estimate.value, low=min(low, estimate.low), high=max(high, estimate.high))

    def root_mean_square(self, values: FloatArray) -> Estimate:
        """Estimate the root mean square of the values (rows,) that are not NaN."""
        squares = np.nan_to_num(values) ** 2
        return self.estimate(lambda s, n: np.sqrt(s / n), squares, ~np.isnan(values), within=(0.0, np.inf))


def independent_share(hits: float, rows: int, level: float = 0.95) -> tuple[float, float]:
    """Return the ends of Wilson's interval of a share of independent rows.

    Examples
    --------
    >>> low, high = independent_share(10, 10)
    >>> round(low, 4), round(high, 4)
    (0.7225, 1.0)
    """
    z = float(ndtri((1 + level) / 2))
    centre = (hits + z**2 / 2) / (rows + z**2)
    half_width = z * np.sqrt(hits * (rows - hits) / rows + z**2 / 4) / (rows + z**2)
    return float(max(0.0, centre - half_width)), float(min(1.0, centre + half_width))


def errors_to_end(count: int, level: float = 0.95) -> float:
    """Return how many standard deviations of the resamples an interval of so many specimens extends to either side.

    Examples
    --------
    >>> round(errors_to_end(2), 2), round(errors_to_end(10**6), 2)
    (17.97, 1.96)
    """
    if count >= FEW:
        return float(ndtri((1 + level) / 2))
    return float(np.sqrt(count / (count - 1)) * stdtrit(count - 1, (1 + level) / 2))
