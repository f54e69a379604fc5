"""Damage location by construction: one scorer looks at one tooth, and is turned around the gear."""

from collections.abc import Iterator
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import softmax
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.model_selection import GroupShuffleSplit
from sklearn.utils.validation import check_is_fitted

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.calibration import calibrated, check_labels, with_none
from sigdb.recognition.learners import tooth_scorer
from sigdb.recognition.views import ToothViews, by_teeth, check_columns

_ROWS_AT_ONCE = 4096


class LocationClassifier(ClassifierMixin, BaseEstimator):
    """Location of damage: 0 for none, else the first damaged tooth.

    A binary scorer, shared by all teeth, is trained to tell the view from the first damaged tooth from views of other
    teeth and of healthy gears. The answer is a softmax over the scores of all teeth and of 'none', with a slope and a
    level of 'none' calibrated on specimens that the scorer has not seen. Turning the signature by j teeth turns the
    answer by j teeth exactly, and a gear of a tooth count
    that was never seen has an answer too; but there the level of 'none' is not calibrated, and may be far off.

    Parameters
    ----------
    learner
        ``"lda"`` (shrinkage linear discriminant analysis) or ``"boosting"`` (gradient boosting of histograms).
    random_state
        Seed of the choice of views from other teeth, of the calibration's specimens, and of boosting.
    """

    _OTHER_TEETH = 3

    def __init__(self, learner: str = "boosting", random_state: int = 0) -> None:
        self.learner = learner
        self.random_state = random_state

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Train on rows of features.

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``.
        y
            First damaged tooth, 0 for none.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        check_columns(X)
        y = np.asarray(y, dtype=int)
        groups = np.arange(len(y)) if groups is None else np.asarray(groups)
        check_labels(X["teeth"].to_numpy(), y)
        if len(np.unique(groups)) < 2:
            groups = np.arange(len(y))  # with one specimen only, its own rows have to calibrate
        self.classes_ = np.arange(int(X["teeth"].max()) + 1)
        self.views_ = ToothViews().fit(X)
        inner, outer = next(GroupShuffleSplit(1, test_size=0.25, random_state=self.random_state).split(X, y, groups))
        self.scorer_ = self._fit_scorer(X.iloc[inner], y[inner])
        self.slope_, self.none_ = 1.0, 0.0
        self.slope_, self.none_ = calibrated(self._tooth_scores(X.iloc[outer]), y[outer])
        self.scorer_ = self._fit_scorer(X, y)
        return self

    def _fit_scorer(self, X: pd.DataFrame, y: IntArray) -> Any:
        """Views from the damaged tooth against a few views from other teeth and from healthy gears."""
        stream = np.random.default_rng(self.random_state)
        seen, labels = [], []
        for teeth, at in by_teeth(X):
            others = np.argsort(stream.random((len(at), teeth - 1)), axis=1)[:, : self._OTHER_TEETH] + 1
            first = np.maximum(y[at], 1) - 1
            columns = (first[:, None] + np.column_stack([np.zeros(len(at), int), others])) % teeth
            seen += [
                np.take_along_axis(views, columns[part][:, :, None], axis=1).reshape(-1, views.shape[2])
                for part, views in self._views_of(X, at, teeth)
            ]
            is_first = np.zeros(columns.shape, bool)
            is_first[:, 0] = y[at] > 0
            labels.append(is_first.ravel())
        return clone(tooth_scorer(self.learner, self.random_state)).fit(np.concatenate(seen), np.concatenate(labels))

    def _tooth_scores(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth) score of each tooth, -inf where a gear has no such tooth."""
        check_columns(X)
        scores = np.full((len(X), int(X["teeth"].max())), -np.inf)
        for teeth, at in by_teeth(X):
            for part, views in self._views_of(X, at, teeth):
                found = self.scorer_.decision_function(views.reshape(-1, views.shape[2]))
                scores[at[part], :teeth] = found.reshape(-1, teeth)
        return scores

    def _views_of(self, X: pd.DataFrame, at: IntArray, teeth: int) -> Iterator[tuple[slice, FloatArray]]:
        """Views of some rows at once: those of all teeth of many rows would not fit into memory."""
        for first in range(0, len(at), _ROWS_AT_ONCE):
            part = slice(first, first + _ROWS_AT_ONCE)
            yield part, self.views_.views(X.iloc[at[part]], teeth)

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) unbounded scores of 'none' and of each tooth; their softmax is the probability."""
        check_is_fitted(self)
        scores = self._tooth_scores(X)
        return with_none(scores, self.slope_, self.none_)

    def predict_proba(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) probability of 'none' and of each tooth."""
        return softmax(self.decision_function(X), axis=1)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) first damaged tooth, 0 for none."""
        return self.decision_function(X).argmax(axis=1)
