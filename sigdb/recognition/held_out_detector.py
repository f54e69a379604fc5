"""A detector whose scorer takes long to train: it is trained once."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import clone
from sklearn.frozen import FrozenEstimator
from sklearn.model_selection import GroupShuffleSplit

from sigdb.recognition.detection import Detector
from sigdb.recognition.location_sets import tooth_and_severity


class HeldOutDetector(Detector):
    """Detection of damage by a scorer that learns from three quarters of the specimens, at thresholds of the others.

    :class:`Detector` trains a scorer anew for each fold of specimens, which is dear where training is; this one trains
    it once, and uses fewer rows for each of the two. Parameters and attributes are those of :class:`Detector`.
    """

    _ASIDE = 0.25

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Train the scorer, and set the thresholds; arguments and errors as of :class:`Detector`."""
        tooth = tooth_and_severity(y)[0]
        groups = np.arange(len(tooth)) if groups is None else np.asarray(groups)
        inner, aside = next(GroupShuffleSplit(1, test_size=self._ASIDE, random_state=0).split(X, tooth, groups))
        self.scorer_ = clone(self.scorer).fit(X.iloc[inner], tooth[inner], groups[inner])
        known = Detector(FrozenEstimator(self.scorer_), self.false_alarm_rate, self.confidence)
        known.fit(X.iloc[aside], tooth[aside], groups[aside])
        for name in ("classes_", "noise_", "thresholds_", "healthy_rows_", "healthy_specimens_"):
            setattr(self, name, getattr(known, name))
        return self
