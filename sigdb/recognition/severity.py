"""Severity of damage: stiffness loss, phase shift and number of damaged teeth, each with an interval."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.model_selection import GroupShuffleSplit
from sklearn.utils.validation import check_is_fitted

from sigdb.recognition.learners import severity_regressor
from sigdb.recognition.location import LocationClassifier
from sigdb.recognition.views import check_columns

TARGETS = ("stiffness_loss", "phase_shift_deg", "damaged_teeth")
"""What severity is."""

COVERAGE = 0.9
"""Nominal coverage of the intervals."""


class SeverityRegressor(RegressorMixin, BaseEstimator):
    """Severity, turn-invariant: judged from the tooth at which a location classifier sees the damage.

    Intervals are symmetric, of the width that covers 90 % of the errors on a quarter of the specimens, which neither
    the location nor the regressors have seen (split conformal prediction). Meant for damaged rows; what it says of a
    healthy gear has no meaning.

    Parameters
    ----------
    learner
        ``"lda"`` (ridge regression, and LDA for the location) or ``"boosting"``.
    random_state
        Seed.
    """

    def __init__(self, learner: str = "boosting", random_state: int = 0) -> None:
        self.learner = learner
        self.random_state = random_state

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Train on rows of features, healthy ones included (they teach the location).

        Parameters
        ----------
        X
            Rows with the columns of ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``.
        y
            ``tooth``, ``stiffness_loss``, ``phase_shift_deg`` and ``damaged_teeth`` of each row.
        groups
            Specimen of each row.
        """
        check_columns(X)
        groups = np.arange(len(X)) if groups is None else np.asarray(groups)
        inner, outer = next(GroupShuffleSplit(1, test_size=0.25, random_state=self.random_state).split(X, y, groups))
        self.location_ = LocationClassifier(self.learner, self.random_state)
        self.location_.fit(X.iloc[inner], y["tooth"].iloc[inner], groups[inner])

        damaged = (y["tooth"] > 0).to_numpy()
        inner, outer = inner[damaged[inner]], outer[damaged[outer]]
        seen = self.location_.views_.view_from(X.iloc[inner], y["tooth"].to_numpy()[inner])
        base = severity_regressor(self.learner, self.random_state)
        self.regressors_ = [clone(base).fit(seen, y[target].to_numpy(float)[inner]) for target in TARGETS]

        errors = np.abs(self._estimates(X.iloc[outer]) - y.iloc[outer][list(TARGETS)].to_numpy(float))
        level = min(1.0, COVERAGE * (1 + 1 / len(outer)))
        self.half_widths_ = np.quantile(errors, level, axis=0, method="higher")
        return self

    def _estimates(self, X: pd.DataFrame) -> np.ndarray:
        tooth = 1 + self.location_.decision_function(X)[:, 1:].argmax(axis=1)
        seen = self.location_.views_.view_from(X, tooth)
        estimates = np.column_stack([regressor.predict(seen) for regressor in self.regressors_])
        limits = np.array([[0.0, -np.inf, 1.0], [1.0, np.inf, np.inf]])
        return np.clip(estimates, *limits)

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """Estimates, and the ends of their intervals as ``NAME_low`` and ``NAME_high``, one row for each of X."""
        check_is_fitted(self)
        estimates = self._estimates(X)
        columns = {}
        for i, target in enumerate(TARGETS):
            columns[target] = estimates[:, i]
            columns[f"{target}_low"] = estimates[:, i] - self.half_widths_[i]
            columns[f"{target}_high"] = estimates[:, i] + self.half_widths_[i]
        return pd.DataFrame(columns, index=X.index)
