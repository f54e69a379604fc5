"""Detection by an estimator of location, at a rate of false alarms that is set."""

import math
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.model_selection import GroupShuffleSplit
from sklearn.utils.validation import check_is_fitted

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.answers import damage_score
from sigdb.recognition.conformal import row_quantile
from sigdb.recognition.location_sets import tooth_and_severity


class LocationDetector(ClassifierMixin, BaseEstimator):
    """Detection of damage by a location estimator: 1 for a damaged gear, 0 for a healthy one.

    The score is the log odds of any tooth against none, or the indicator of a baseline. The estimator learns from three
    quarters of the specimens, and the threshold is the conformal quantile of the scores of the healthy rows of the
    others, so that a further healthy row, exchangeable with these, is above it with a probability of the set rate at
    most.

    Parameters
    ----------
    scorer
        An estimator of location with a ``decision_function`` or an ``indicator``; a copy of it is fitted.
    false_alarm_rate
        Rate of false alarms, between 0 and 1.
    random_state
        Seed of the choice of specimens.

    Attributes
    ----------
    scorer_
        The fitted estimator.
    threshold_
        Greatest score of a gear that is called healthy.
    healthy_rows_, healthy_specimens_
        What it was set on.
    """

    def __init__(self, scorer: Any, false_alarm_rate: float = 0.01, random_state: int = 0) -> None:
        self.scorer = scorer
        self.false_alarm_rate = false_alarm_rate
        self.random_state = random_state

    @property
    def reducer(self) -> Any:
        """What the scorer reads of averages; None where it reads none."""
        return getattr(self.scorer, "reducer", None)

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Train the scorer and set the threshold.

        Parameters
        ----------
        X
            Rows as the scorer takes them.
        y
            First damaged tooth, 0 for none.
        groups
            Specimen of each row; each row counts as its own if left out, or with one specimen only.

        Raises
        ------
        InputError
            If the rate is not between 0 and 1, or takes more healthy rows of specimens put aside: ``1 / rate - 1`` at
            least.
        """
        tooth = tooth_and_severity(y)[0]
        groups = np.arange(len(tooth)) if groups is None else np.asarray(groups)
        if len(np.unique(groups)) < 2:
            groups = np.arange(len(tooth))
        inner, outer = next(
            GroupShuffleSplit(1, test_size=0.25, random_state=self.random_state).split(X, tooth, groups)
        )
        outer = outer[tooth[outer] == 0]
        _check(self.false_alarm_rate, len(outer))
        self.scorer_ = clone(self.scorer).fit(X.iloc[inner], tooth[inner], groups[inner])
        self.classes_ = np.array([0, 1])
        self.threshold_ = row_quantile(self._score(X.iloc[outer]), 1 - self.false_alarm_rate)
        self.healthy_rows_, self.healthy_specimens_ = len(outer), len(np.unique(groups[outer]))
        return self

    def _score(self, X: pd.DataFrame) -> FloatArray:
        if hasattr(self.scorer_, "indicator"):
            return np.asarray(self.scorer_.indicator(X))
        return damage_score(self.scorer_.decision_function(X))

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) by how much the score is above the threshold."""
        check_is_fitted(self)
        return self._score(X) - self.threshold_

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) 1 for damage, 0 for none."""
        return (self.decision_function(X) > 0).astype(int)


def _check(rate: float, healthy: int) -> None:
    if not 0 < rate < 1:
        raise InputError(f"false_alarm_rate = {rate:g} must be between 0 and 1, such as 0.01")
    needed = math.ceil(1 / rate - 1 - 1e-9)
    if healthy < needed:
        raise InputError(
            f"false_alarm_rate = {rate:g} needs {needed} healthy rows of specimens put aside, there are {healthy}; "
            f"give more of them, or ask for a rate of {1 / (healthy + 1):.2g} or more"
        )
