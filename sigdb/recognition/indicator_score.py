"""An indicator as scores of location, for detectors."""

from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, clone

from sigdb.core.typing import FloatArray
from sigdb.recognition.threshold_location import ThresholdLocation


class IndicatorScore(BaseEstimator):
    """The indicator of a baseline as the score of damage, whichever the tooth, with 0 for none.

    Parameters
    ----------
    baseline
        A baseline; a copy of it is fitted.
    """

    def __init__(self, baseline: ThresholdLocation) -> None:
        self.baseline = baseline

    @property
    def reducer(self) -> Any:
        """What the baseline reads of averages; None where it reads none."""
        return getattr(self.baseline, "reducer", None)

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Fit the baseline."""
        self.baseline_ = clone(self.baseline).fit(X, y, groups)
        return self

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows, 2) 0 and the indicator."""
        indicator = self.baseline_.indicator(X)
        return np.column_stack([np.zeros_like(indicator), indicator])
