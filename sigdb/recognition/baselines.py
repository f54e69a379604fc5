"""What a model must beat: the majority, and a threshold on FM4."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin
from sklearn.isotonic import IsotonicRegression

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.severity import TARGETS

FALSE_ALARM_RATE = 0.01


class MajorityLocation(ClassifierMixin, BaseEstimator):
    """Always the most frequent class of the training rows."""

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Count the classes."""
        self.classes_, counts = np.unique(np.asarray(y, int), return_counts=True)
        self.answer_ = int(self.classes_[counts.argmax()])
        return self

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) the same answer for every row."""
        return np.full(len(X), self.answer_)


class Fm4Location(ClassifierMixin, BaseEstimator):
    """Damage where FM4 exceeds the value that one healthy training row in a hundred exceeds.

    FM4 is the same for any tooth, so it cannot tell which: the tooth named is the most frequent one.
    """

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Set the threshold at the false-alarm rate of 0.01."""
        y = np.asarray(y, int)
        self.classes_ = np.unique(y)
        self.threshold_ = float(np.quantile(X["fm4"].to_numpy()[y == 0], 1 - FALSE_ALARM_RATE))
        teeth, counts = np.unique(y[y > 0], return_counts=True)
        self.tooth_ = int(teeth[counts.argmax()])
        return self

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) 0 below the threshold, else the most frequent tooth."""
        return np.where(X["fm4"].to_numpy() > self.threshold_, self.tooth_, 0)


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
