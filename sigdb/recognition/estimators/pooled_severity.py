"""Severity of damage: stiffness loss, phase shift and number of damaged teeth, each with an interval."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray
from sigdb.recognition.calibration.cells import noise_db, points_of
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.calibration.probabilities import specimen_folds_of
from sigdb.recognition.calibration.severity_intervals import SeverityIntervals
from sigdb.recognition.estimators.pooled_location import FOLDS, LocationClassifier, own_groups, severity_regressor
from sigdb.recognition.rows.tooth_views import check_columns
from sigdb.recognition.severity_quantities import QUANTITIES


class SeverityRegressor(SeverityIntervals, RegressorMixin, BaseEstimator):
    """Severity, turn-invariant: judged from the tooth at which a location classifier sees the damage.

    Intervals are those of :class:`SeverityIntervals`, of errors on specimens that neither the location nor the
    regressors had seen; then both learn from all. Bands are of the noise itself, in dB of the sensor's unit. Meant for
    damaged rows; what it says of a healthy gear has no meaning.

    Parameters
    ----------
    learner
        ``"lda"`` (ridge regression, and LDA for the location) or ``"boosting"``.
    random_state
        Seed.
    coverage
        Nominal coverage of the intervals. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer
        the intervals are the whole range.

    Attributes
    ----------
    levels_, edges_, thresholds_
        As of :class:`SeverityIntervals`.
    """

    def __init__(self, learner: str = "boosting", random_state: int = 0, coverage: float = COVERAGE) -> None:
        self.learner = learner
        self.random_state = random_state
        self.coverage = coverage

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Train on rows of features, healthy ones included (they teach the location).

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``; for intervals that follow the
            noise also ``averages`` and ``scatter``.
        y
            ``tooth``, ``stiffness_loss``, ``phase_shift_deg`` and ``damaged_teeth`` of each row.
        groups
            Specimen of each row.
        """
        check_columns(X)
        groups = own_groups(groups, len(X))
        true, damaged = y[list(QUANTITIES)].to_numpy(float), (y["tooth"] > 0).to_numpy()
        errors = np.empty(true.shape)
        for inner, outer in specimen_folds_of(groups, FOLDS):
            other = clone(self)._learnt(X.iloc[inner], y.iloc[inner])
            errors[outer] = np.abs(other._estimates(X.iloc[outer]) - true[outer])
        seen = X[damaged]
        self._fit_intervals(
            errors[damaged], true[damaged], point=points_of(seen), noise=noise_db(seen), groups=groups[damaged]
        )
        return self._learnt(X, y)

    def _learnt(self, X: pd.DataFrame, y: pd.DataFrame) -> Self:
        """Learn where to look, and what to say of it."""
        tooth = y["tooth"].to_numpy(int)
        self.location_ = LocationClassifier(self.learner, self.random_state).fit_scorer(X, tooth)
        seen = self.location_.views_.view_from(X[tooth > 0], tooth[tooth > 0])
        base = severity_regressor(self.learner, self.random_state)
        self.regressors_ = [clone(base).fit(seen, y[target].to_numpy(float)[tooth > 0]) for target in QUANTITIES]
        return self

    def _estimates(self, X: pd.DataFrame) -> FloatArray:
        tooth = 1 + self.location_.tooth_scores(X).argmax(axis=1)
        seen = self.location_.views_.view_from(X, tooth)
        estimates = np.column_stack([regressor.predict(seen) for regressor in self.regressors_])
        limits = np.array([[0.0, -np.inf, 1.0], [1.0, np.inf, np.inf]])
        return np.asarray(np.clip(estimates, *limits))

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """Estimates, and the ends of their intervals as ``NAME_low`` and ``NAME_high``, one row for each of X."""
        check_is_fitted(self)
        estimates = self._estimates(X)
        columns = self._with_intervals(QUANTITIES, estimates, np.ones(estimates.shape), noise_db(X))
        return pd.DataFrame(columns, index=X.index)
