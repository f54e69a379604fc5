"""Conformal intervals of severities whose coverage holds for each severity, noise and operating point."""

from collections.abc import Sequence

import numpy as np

from sigdb.core import FloatArray, IntArray, blocks
from sigdb.recognition.calibration.cells import band_edges, band_thresholds, bands, cells_of, levels_of
from sigdb.recognition.calibration.conformal import BY_CELL, OVER_ALL, greatest_quantile, specimen_quantile
from sigdb.recognition.rows.batch import ROWS_AT_ONCE
from sigdb.transmission import SIZES

_CANDIDATES = 101


class SeverityIntervals:
    """Intervals of a severity regressor, for estimators with the parameter ``coverage``.

    An interval holds the values v that conform, ``|estimate - v| <= q(v, noise) scale``, and the estimate itself. In
    each band of noise, q is a conformal quantile by specimen of the training rows whose true value is v. It is the
    greatest of these quantiles over the other severities and the operating points, and is interpolated between values
    of the grid. So coverage is meant to hold for each severity, noise and operating point, with the limits that
    :class:`LocationSets` states. Intervals stay within the range of the training rows.
    With ``coverage_by = "all"`` there is one threshold for all values and all noise, and coverage is an average over
    all rows.

    Attributes
    ----------
    levels_
        Values v of each severity.
    edges_
        (bands - 1,) edges between bands of noise, dB.
    thresholds_
        (bands, values) q of each severity.
    """

    coverage: float
    coverage_by: str = BY_CELL
    levels_: list[FloatArray]
    edges_: FloatArray
    thresholds_: list[FloatArray]
    quantities_: tuple[str, ...]

    @property
    def greatest(self) -> dict[str, float]:
        """By size of damage, the greatest value that intervals hold."""
        names = zip(self.quantities_, self.levels_, strict=True)
        return {name: float(levels[-1]) for name, levels in names if name in SIZES}

    def _fit_intervals(
        self, strange: FloatArray, true: FloatArray, *, point: IntArray, noise: FloatArray, groups: IntArray
    ) -> None:
        """Set the thresholds from errors in units of the scale, and true values, both (rows, severities).

        Values are nan where the damage does not have the severity; these do not count for it.
        """
        if self.coverage_by == OVER_ALL:
            self.edges_ = np.array([])
            self.levels_ = [_levels(value)[0] for value in true.T]
            self.thresholds_ = [
                np.full((1, len(levels)), specimen_quantile(error[has], groups[has], self.coverage))
                for error, has, levels in zip(strange.T, np.isfinite(true.T), self.levels_, strict=True)
            ]
            return
        self.edges_ = band_edges(noise, groups, self.coverage)
        band, cells = bands(self.edges_, noise), cells_of(point, true)
        self.levels_, self.thresholds_ = [], []
        for error, value in zip(strange.T, true.T, strict=True):
            levels, nearest = _levels(value)
            quantiles = [
                [
                    greatest_quantile(error[some], cells[some], groups[some], self.coverage)
                    for k in range(len(levels))
                    for some in [(band == number) & (nearest == k)]
                ]
                for number in range(len(self.edges_) + 1)
            ]
            self.levels_.append(levels)
            self.thresholds_.append(np.array(quantiles))

    def _with_intervals(
        self, names: Sequence[str], estimates: FloatArray, scale: FloatArray, noise: FloatArray
    ) -> dict[str, FloatArray]:
        """Columns of estimates (rows, severities) and of the ends of their intervals, scale of the same shape."""
        columns: dict[str, FloatArray] = {}
        for i, name in enumerate(names):
            limit = band_thresholds(self.thresholds_[i], self.edges_, noise)
            low, high = conforming(estimates[:, i], scale[:, i], self.levels_[i], limit)
            columns |= {name: estimates[:, i], f"{name}_low": low, f"{name}_high": high}
        return columns


def _levels(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return levels as :func:`levels_of` does, 0 alone where no value is known."""
    levels, nearest = levels_of(values)
    return (levels, nearest) if len(levels) else (np.zeros(1), nearest + 1)


def conforming(
    estimate: FloatArray, scale: FloatArray, levels: FloatArray, limit: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest of the values that conform and the estimate itself.

    Parameters
    ----------
    estimate, scale
        (rows,) estimates, and the unit of their errors.
    levels
        (k,) values at which the thresholds are known.
    limit
        (rows, k) greatest error that conforms at each, in units of the scale.
    """
    candidates = np.union1d(np.linspace(levels[0], levels[-1], _CANDIDATES), levels)
    # Infinite thresholds cannot be interpolated; this one lets all values conform.
    limit = np.minimum(limit, np.finfo(float).max / 4)
    weights = np.stack([np.interp(candidates, levels, unit) for unit in np.eye(len(levels))])
    low, high = estimate.copy(), estimate.copy()
    for some in blocks(len(estimate), ROWS_AT_ONCE):
        within = np.abs(estimate[some, None] - candidates) / scale[some, None] <= limit[some] @ weights
        low[some] = np.minimum(low[some], np.where(within, candidates, np.inf).min(axis=1))
        high[some] = np.maximum(high[some], np.where(within, candidates, -np.inf).max(axis=1))
    return low, high
