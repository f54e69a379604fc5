"""Severity from template scores: posterior median, calibrated, with intervals that hold for each severity."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.calibration import specimen_folds_of
from sigdb.recognition.conformal import specimen_quantile
from sigdb.recognition.severity import TARGETS
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_scores import TemplateScores

_CANDIDATES = 101
_MOST_LEVELS = 12
"""Levels of a severity that each have a threshold; more than these are taken together in as many groups."""
_ROWS_AT_ONCE = 4096


class TemplateSeverity(RegressorMixin, BaseEstimator):
    """Severity from a bank of templates: stiffness loss, phase shift and number of damaged teeth, with intervals.

    The estimate is the median of the posterior given damage, whatever the tooth (:class:`TemplateScores`), times a
    slope plus a level that make the mean absolute error least. An interval holds the values v that conform,
    ``|estimate - v| <= q(v) (spread + s0)``: spread is the posterior's standard deviation, s0 its mean over the
    training rows, and q(v) the conformal quantile of the training rows whose true value is v, by specimen, from
    estimates that were calibrated without their specimens; between values of the grid it is interpolated. So coverage
    is meant for each severity, not on average only. Intervals stay within the range of the training rows.

    Parameters
    ----------
    bank
        Templates.
    coverage
        Nominal coverage of the intervals. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer
        the intervals are the whole range.
    n_jobs
        Threads of the scores.

    Attributes
    ----------
    corrections_
        (3, 2) level and slope of each severity's correction.
    levels_, thresholds_
        By severity, values v and q(v).
    floors_
        (3,) s0.
    """

    def __init__(self, bank: TemplateBank, coverage: float = 0.9, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.coverage = coverage
        self.n_jobs = n_jobs

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Calibrate on damaged rows; healthy ones do not count.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.
        y
            ``tooth``, ``stiffness_loss``, ``phase_shift_deg`` and ``damaged_teeth`` of each row.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        damaged = (y["tooth"] > 0).to_numpy()
        if not damaged.any():
            raise InputError("y holds no damaged rows, and severity is learnt from them; add some")
        groups = np.arange(len(X)) if groups is None else np.asarray(groups)
        median, spread = self._median_and_spread(X[damaged])
        true, groups = y.loc[damaged, list(TARGETS)].to_numpy(float), groups[damaged]
        self.floors_ = np.where(spread.mean(axis=0) > 0, spread.mean(axis=0), 1.0)
        self.corrections_ = np.array([_correction(median[:, i], true[:, i]) for i in range(len(TARGETS))])
        self.levels_, self.thresholds_ = [], []
        for i in range(len(TARGETS)):
            strange = _strangeness(median[:, i], true[:, i], groups) / (spread[:, i] + self.floors_[i])
            levels, thresholds = _by_level(true[:, i], strange, groups, self.coverage)
            self.levels_.append(levels)
            self.thresholds_.append(thresholds)
        return self

    def _median_and_spread(self, X: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
        scores = TemplateScores(self.bank, self.n_jobs).transform(X)
        median, spread = np.split(scores[:, -2 * len(TARGETS) :], 2, axis=1)
        if np.isnan(median).any():
            raise InputError("the bank has no template with one severity for all damaged teeth; train on a plain grid")
        return median, spread

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """Estimates, and the ends of their intervals as ``NAME_low`` and ``NAME_high``, one row for each of X."""
        check_is_fitted(self)
        median, spread = self._median_and_spread(X)
        columns: dict[str, FloatArray] = {}
        for i, target in enumerate(TARGETS):
            levels = self.levels_[i]
            estimate = np.clip(_corrected(median[:, i], self.corrections_[i]), levels[0], levels[-1])
            low, high = _interval(estimate, spread[:, i] + self.floors_[i], levels, self.thresholds_[i])
            columns |= {target: estimate, f"{target}_low": low, f"{target}_high": high}
        return pd.DataFrame(columns, index=X.index)


def _corrected(median: FloatArray, correction: FloatArray) -> FloatArray:
    level, slope = correction
    return level + slope * median


def _correction(median: FloatArray, true: FloatArray) -> FloatArray:
    """Level and slope of least mean absolute error; near to none, 0 and 1, where those are as good."""

    def loss(parameters: FloatArray) -> float:
        return float(np.abs(_corrected(median, parameters) - true).mean())

    found = minimize(loss, np.array([0.0, 1.0]), method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-12}).x
    return np.asarray(found)


def _strangeness(median: FloatArray, true: FloatArray, groups: IntArray) -> FloatArray:
    """(rows,) absolute error of estimates that were calibrated on other specimens."""
    strange = np.empty(len(true))
    for inner, outer in specimen_folds_of(groups):
        strange[outer] = np.abs(_corrected(median[outer], _correction(median[inner], true[inner])) - true[outer])
    return strange


def _by_level(
    true: FloatArray, strange: FloatArray, groups: IntArray, coverage: float
) -> tuple[FloatArray, FloatArray]:
    """Values of a severity and the conformal quantile at each."""
    values = np.unique(true)
    if len(values) > _MOST_LEVELS:
        values = np.unique(np.quantile(true, np.linspace(0, 1, _MOST_LEVELS), method="nearest"))
    nearest = np.abs(true[:, None] - values).argmin(axis=1)
    thresholds = [specimen_quantile(strange[nearest == k], groups[nearest == k], coverage) for k in range(len(values))]
    return values, np.array(thresholds)


def _interval(
    estimate: FloatArray, scale: FloatArray, levels: FloatArray, thresholds: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Ends of the values that conform, and of the estimate itself."""
    candidates = np.union1d(np.linspace(levels[0], levels[-1], _CANDIDATES), levels)
    # Infinite thresholds cannot be interpolated; this one lets all values conform.
    limit = np.interp(candidates, levels, np.minimum(thresholds, np.finfo(float).max / 4))
    low, high = estimate.copy(), estimate.copy()
    for first in range(0, len(estimate), _ROWS_AT_ONCE):
        some = slice(first, first + _ROWS_AT_ONCE)
        within = np.abs(estimate[some, None] - candidates) / scale[some, None] <= limit
        low[some] = np.minimum(low[some], np.where(within, candidates, np.inf).min(axis=1))
        high[some] = np.maximum(high[some], np.where(within, candidates, -np.inf).max(axis=1))
    return low, high
