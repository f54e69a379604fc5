"""What a model must beat: the majority, and a threshold on FM4."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin
from sklearn.isotonic import IsotonicRegression

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.location_sets import tooth_and_severity
from sigdb.recognition.severity import TARGETS
from sigdb.recognition.threshold_location import ThresholdLocation


class MajorityLocation(ClassifierMixin, BaseEstimator):
    """Always the most frequent class of the training rows."""

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Count the classes."""
        self.classes_, counts = np.unique(tooth_and_severity(y)[0], return_counts=True)
        self.answer_ = int(self.classes_[counts.argmax()])
        return self

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) the same answer for every row."""
        return np.full(len(X), self.answer_)


class Fm4Location(ThresholdLocation):
    """Damage where FM4 exceeds the value that one healthy training row in a hundred, or another set share, exceeds.

    FM4 is the same for any tooth, so it cannot tell which: the tooth named is the most frequent one.
    """

    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) FM4."""
        return X["fm4"].to_numpy(float)


class MajoritySeverity(RegressorMixin, BaseEstimator):
    """Always the median of the damaged training rows."""

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Take the medians."""
        self.medians_ = y.loc[y["tooth"] > 0, list(TARGETS)].median().to_numpy(float)
        return self

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """The same estimates for every row."""
        return pd.DataFrame([self.medians_] * len(X), columns=TARGETS, index=X.index)


class Fm4Severity(RegressorMixin, BaseEstimator):
    """Each target as a monotonic function of FM4 alone."""

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Fit one isotonic regression for each target to the damaged rows."""
        damaged = (y["tooth"] > 0).to_numpy()
        fm4 = X["fm4"].to_numpy(float)[damaged]
        self.regressors_ = [_monotonic(fm4, y[target].to_numpy(float)[damaged]) for target in TARGETS]
        return self

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """Estimates for each row."""
        fm4 = X["fm4"].to_numpy(float)
        return pd.DataFrame(
            {name: one.predict(fm4) for name, one in zip(TARGETS, self.regressors_, strict=True)}, index=X.index
        )


def _monotonic(fm4: FloatArray, target: FloatArray) -> IsotonicRegression:
    """An isotonic regression, rising or falling as the two vary together."""
    together = float(((fm4 - fm4.mean()) * (target - target.mean())).sum())
    return IsotonicRegression(increasing=together >= 0, out_of_bounds="clip").fit(fm4, target)
