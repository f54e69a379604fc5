"""Severity from template scores: posterior median, calibrated, with intervals that hold for each severity."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.calibration.probabilities import specimen_folds_of
from sigdb.recognition.calibration.severity_intervals import SeverityIntervals
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.scores import TemplateScores, noise_at_point


class TemplateSeverity(SeverityIntervals, RegressorMixin, BaseEstimator):
    """Severity from a bank of templates: stiffness loss, phase shift and number of damaged teeth, with intervals.

    The estimate is the median of the posterior given damage, whatever the tooth (:class:`TemplateScores`), times a
    slope plus a level that make the mean absolute error least. Intervals are those of :class:`SeverityIntervals`: the
    scale of errors is the posterior's standard deviation ``spread`` plus its mean s0 over the training rows, the errors
    are of estimates that were calibrated without their specimens, and bands are of the noise relative to the bank's
    healthy signal.

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
    levels_, edges_, thresholds_
        As of :class:`SeverityIntervals`.
    floors_
        (3,) s0.
    """

    def __init__(self, bank: TemplateBank, coverage: float = COVERAGE, n_jobs: int | None = None) -> None:
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
        true, groups = y.loc[damaged, list(QUANTITIES)].to_numpy(float), groups[damaged]
        self.floors_ = np.where(spread.mean(axis=0) > 0, spread.mean(axis=0), 1.0)
        self.corrections_ = np.array([_correction(median[:, i], true[:, i]) for i in range(len(QUANTITIES))])
        errors = np.column_stack([_errors(median[:, i], true[:, i], groups) for i in range(len(QUANTITIES))])
        point, noise = noise_at_point(self.bank, X[damaged])
        self._fit_intervals(errors / (spread + self.floors_), true, point=point, noise=noise, groups=groups)
        return self

    def _median_and_spread(self, X: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
        scores = TemplateScores(self.bank, self.n_jobs).transform(X)
        median, spread = np.split(scores[:, -2 * len(QUANTITIES) :], 2, axis=1)
        if np.isnan(median).any():
            raise InputError("the bank has no template with one severity for all damaged teeth; train on a plain grid")
        return median, spread

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """Estimates, and the ends of their intervals as ``NAME_low`` and ``NAME_high``, one row for each of X."""
        check_is_fitted(self)
        median, spread = self._median_and_spread(X)
        estimates = np.column_stack(
            [
                np.clip(_corrected(median[:, i], self.corrections_[i]), self.levels_[i][0], self.levels_[i][-1])
                for i in range(len(QUANTITIES))
            ]
        )
        columns = self._with_intervals(QUANTITIES, estimates, spread + self.floors_, noise_at_point(self.bank, X)[1])
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


def _errors(median: FloatArray, true: FloatArray, groups: IntArray) -> FloatArray:
    """(rows,) absolute error of estimates that were calibrated on other specimens."""
    errors = np.empty(len(true))
    for inner, outer in specimen_folds_of(groups):
        errors[outer] = np.abs(_corrected(median[outer], _correction(median[inner], true[inner])) - true[outer])
    return errors
