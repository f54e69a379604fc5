"""What baselines of location share: damage where an indicator is above a threshold."""

from abc import ABC, abstractmethod
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.location_sets import tooth_and_severity

FALSE_ALARM_RATE = 0.01


class ThresholdLocation(ABC, ClassifierMixin, BaseEstimator):
    """Damage where an indicator exceeds the value that a set share of the healthy training rows exceeds.

    The tooth is the one that the indicator names; of an indicator that names none it is the most frequent one of the
    training rows.

    Parameters
    ----------
    false_alarm_rate
        Share of the healthy training rows that exceed the threshold.
    """

    def __init__(self, false_alarm_rate: float = FALSE_ALARM_RATE) -> None:
        self.false_alarm_rate = false_alarm_rate

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Set the threshold.

        Parameters
        ----------
        X
            Rows with what the indicator is made of.
        y
            First damaged tooth, 0 for none.
        groups
            Not used.
        """
        y = tooth_and_severity(y)[0]
        self.classes_ = np.unique(y)
        healthy = X[y == 0]
        self._learn(healthy)
        self.threshold_ = float(np.quantile(self.indicator(healthy), 1 - self.false_alarm_rate))
        teeth, counts = np.unique(y[y > 0], return_counts=True)
        self.tooth_ = int(teeth[counts.argmax()])
        return self

    def _learn(self, healthy: pd.DataFrame) -> None:
        """Learn what the indicator is relative to."""

    @abstractmethod
    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) indicator, greater for damage."""

    def tooth(self, X: pd.DataFrame) -> IntArray:
        """(rows,) tooth that would be named of each row, were it called damaged."""
        return np.full(len(X), self.tooth_)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) 0 up to the threshold, else the tooth."""
        check_is_fitted(self)
        return np.where(self.indicator(X) > self.threshold_, self.tooth(X), 0)
