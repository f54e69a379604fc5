"""Severity of damage: the quantities that it has, such as a stiffness loss, each with an interval."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.calibration.cells import points_of
from sigdb.recognition.calibration.probabilities import specimen_folds_of
from sigdb.recognition.calibration.severity_intervals import SeverityIntervals
from sigdb.recognition.estimators.contract import Labels, SeverityEstimator, severity_labels
from sigdb.recognition.estimators.pooled_location import (
    FOLDS,
    LocationClassifier,
    PooledEstimator,
    own_groups,
    pooled_learner,
)
from sigdb.recognition.rows.batch import Batch, Rows


class SeverityRegressor(PooledEstimator, SeverityIntervals, RegressorMixin, SeverityEstimator):
    """Severity of damage, estimated from the view of the tooth that a location classifier names.

    Turning a signature does not change its severity. Intervals are those of :class:`SeverityIntervals`, from errors on
    specimens that neither the classifier nor the regressors had seen; then both learn from all. Bands are of the noise
    itself, in dB of the sensor's unit. The estimate for a healthy gear has no meaning.

    Parameters
    ----------
    learner
        ``"lda"`` (ridge regression, and LDA for the location) or ``"boosting"``.
    random_state
        Seed.
    coverage
        Nominal coverage of the intervals. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer
        the intervals are the whole range.
    columns
        Further columns of ``features`` that views hold, see :class:`ToothViews`.
    coverage_by
        ``cell`` or ``all``: whether coverage holds in each cell or on average over all rows.

    Attributes
    ----------
    levels_, edges_, thresholds_
        As of :class:`SeverityIntervals`.
    """

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Train on rows of features, healthy ones included (they teach the location).

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``; for intervals that follow the
            noise also ``averages`` and ``scatter``.
        y
            ``tooth`` of each row and a column for each quantity, nan where its damage does not have it.
        groups
            Specimen of each row.
        """
        batch, labels = self._batch(X), severity_labels(y)
        groups = own_groups(groups, len(batch))
        self.quantities_ = tuple(str(name) for name in labels if name != "tooth")
        true, damaged = labels[list(self.quantities_)].to_numpy(float), (labels["tooth"] > 0).to_numpy()
        errors = np.empty(true.shape)
        for inner, outer in specimen_folds_of(groups, FOLDS):
            other = clone(self)._learn(batch.take(inner), labels.iloc[inner])
            errors[outer] = np.abs(other._estimates(batch.take(outer)) - true[outer])
        seen = batch.take(damaged)
        self._fit_intervals(
            errors[damaged], true[damaged], point=points_of(seen), noise=seen.noise_db(), groups=groups[damaged]
        )
        return self._learn(batch, labels)

    def _learn(self, batch: Batch, labels: pd.DataFrame) -> Self:
        """Train the location classifier, and the regressors of severity on views."""
        tooth = labels["tooth"].to_numpy(int)
        damaged = tooth > 0
        location = LocationClassifier(self.learner, self.random_state, columns=self.columns)
        self.location_ = location.fit_scorer(batch, tooth)
        seen = self.location_.views_.view_from(batch.take(damaged), tooth[damaged])
        regressor = pooled_learner(self.learner).regressor
        self.quantities_ = tuple(str(name) for name in labels if name != "tooth")
        self.regressors_ = []
        for name in self.quantities_:
            true = labels[name].to_numpy(float)[damaged]
            has = np.isfinite(true)
            self.regressors_.append(regressor(self.random_state).fit(seen[has], true[has]))
        return self

    def _estimates(self, batch: Batch) -> FloatArray:
        tooth = 1 + self.location_.tooth_scores(batch).argmax(axis=1)
        seen = self.location_.views_.view_from(batch, tooth)
        estimates = np.column_stack([regressor.predict(seen) for regressor in self.regressors_])
        shown = [SHOWN_QUANTITIES[name] for name in self.quantities_]
        return np.clip(estimates, [each.least for each in shown], [each.most for each in shown])

    def predict(self, X: Rows) -> pd.DataFrame:
        """Return estimates and the ends of their intervals, ``NAME_low`` and ``NAME_high``, one row for each of X."""
        check_is_fitted(self)
        batch = self._batch(X)
        estimates = self._estimates(batch)
        columns = self._with_intervals(self.quantities_, estimates, np.ones(estimates.shape), batch.noise_db())
        return pd.DataFrame(columns, index=batch.index)
