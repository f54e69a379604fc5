"""Damage location by construction: one scorer looks at one tooth, and is turned around the gear."""

from collections.abc import Iterator
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import softmax
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor
from sklearn.feature_selection import VarianceThreshold
from sklearn.linear_model import RidgeCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.validation import check_is_fitted

from sigdb.core import BoolArray, FloatArray, InputError, IntArray
from sigdb.recognition.calibration.cells import band_edges, bands, noise_db, points_of
from sigdb.recognition.calibration.conformal import COVERAGE, rows_by_cell
from sigdb.recognition.calibration.location_sets import LocationSets, strangeness, tooth_and_severity
from sigdb.recognition.calibration.probabilities import calibrate, check_labels, specimen_folds_of, with_none
from sigdb.recognition.rows.tooth_views import ToothViews, by_teeth, check_columns

LEARNERS = {
    "lda": "shrinkage linear discriminant analysis",
    "boosting": "gradient boosting of histograms",
    "templates": "likelihoods of a bank of templates, calibrated",
}
"""Learners by name."""

POOLED = ("lda", "boosting")
"""Those that look at pooled Wigner-Ville features."""


def tooth_scorer(learner: str, random_state: int) -> BaseEstimator:
    """An unfitted binary classifier with a ``decision_function``.

    Raises
    ------
    InputError
        If there is no such learner.
    """
    _check(learner)
    if learner == "lda":
        return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")
    return HistGradientBoostingClassifier(max_iter=100, early_stopping=False, random_state=random_state)


def severity_regressor(learner: str, random_state: int) -> BaseEstimator:
    """An unfitted regressor: the linear partner of LDA, or boosting."""
    _check(learner)
    if learner == "lda":
        # Columns that do not vary, such as the speed of one operating point, have no scale.
        return make_pipeline(VarianceThreshold(), StandardScaler(), RidgeCV(alphas=(1.0, 10.0, 100.0, 1000.0)))
    return HistGradientBoostingRegressor(max_iter=100, early_stopping=False, random_state=random_state)


def _check(learner: str) -> None:
    if learner not in POOLED:
        raise InputError(f"learner = {learner!r} is not known; choose one of {', '.join(POOLED)}")


FOLDS = 2
"""Parts of the specimens, each scored by what the other ones have taught."""

_ROWS_AT_ONCE = 4096


class LocationClassifier(LocationSets, ClassifierMixin, BaseEstimator):
    """Location of damage: 0 for none, else the first damaged tooth.

    A binary scorer, shared by all teeth, is trained to tell the view from the first damaged tooth from views of other
    teeth and of healthy gears. The answer is a softmax over the scores of all teeth and of 'none'. Their slope, the
    level of 'none' and the thresholds of conformal sets (:class:`LocationSets`) are set in bands of the noise (in dB of
    the sensor's unit), on scores of specimens that the scorer had not seen; then the scorer learns from all.

    Turning the signature by j teeth turns the answer by j teeth exactly. A gear of a tooth count that was never seen
    has an answer too. Of Z teeth each has the prior odds ``1 / (r Z)`` against none, r the odds of none against damage,
    so the level of 'none' is ``none_ + log Z``.

    Parameters
    ----------
    learner
        ``"lda"`` (shrinkage linear discriminant analysis) or ``"boosting"`` (gradient boosting of histograms).
    random_state
        Seed of the choice of views from other teeth, and of boosting.
    coverage
        Nominal coverage of the sets. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer every
        set holds every answer.

    Attributes
    ----------
    slope_, none_
        (1 + bands,) slope of the scores, and level of 'none' without log Z: of all rows, for records whose noise is not
        known, then of each band.
    set_edges_, set_thresholds_
        As of :class:`LocationSets`.
    """

    _OTHER_TEETH = 3

    def __init__(self, learner: str = "boosting", random_state: int = 0, coverage: float = COVERAGE) -> None:
        self.learner = learner
        self.random_state = random_state
        self.coverage = coverage

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Train on rows of features.

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``; for sets that follow the noise
            also ``averages`` and ``scatter``.
        y
            First damaged tooth, 0 for none; or a frame with ``tooth`` and severities, for each of which coverage is to
            hold.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        check_columns(X)
        tooth, severity = tooth_and_severity(y)
        check_labels(X["teeth"].to_numpy(), tooth)
        groups = own_groups(groups, len(X))
        self.classes_ = np.arange(int(X["teeth"].max()) + 1)
        scores = self._unseen_scores(X, tooth, groups)
        noise = noise_db(X)
        own = rows_by_cell(bands(band_edges(noise, groups, self.coverage), noise, len(X)))
        strange, levels = np.empty(len(X)), []
        for at in (np.arange(len(X)), *own):
            prior = _log_teeth(scores[at])
            levels.append(calibrate(scores[at], tooth[at], prior))
            strange[at] = strangeness(scores[at], tooth[at], groups[at], prior)
        self.slope_, self.none_ = np.array(levels).T
        self._fit_sets(strange, tooth, severity, point=points_of(X), noise=noise, groups=groups)
        return self.fit_scorer(X, tooth)

    def fit_scorer(self, X: pd.DataFrame, y: IntArray) -> Self:
        """Train the scorer alone, on rows of features and their first damaged tooth."""
        self.views_ = ToothViews().fit(X)
        self.scorer_ = self._fit_scorer(X, y)
        return self

    def _unseen_scores(self, X: pd.DataFrame, y: IntArray, groups: IntArray) -> FloatArray:
        """(rows, most teeth) scores by what other specimens have taught."""
        scores = np.full((len(X), self.classes_[-1]), -np.inf)
        for inner, outer in specimen_folds_of(groups, FOLDS):
            found = clone(self).fit_scorer(X.iloc[inner], y[inner]).tooth_scores(X.iloc[outer])
            scores[outer, : found.shape[1]] = found
        return scores

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

    def tooth_scores(self, X: pd.DataFrame) -> FloatArray:
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
        scores, noise = self.tooth_scores(X), noise_db(X)
        band = 0 if noise is None else 1 + bands(self.set_edges_, noise, len(X))
        return with_none(scores, self.slope_[band], self.none_[band] + _log_teeth(scores))

    def predict_proba(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) probability of 'none' and of each tooth."""
        return softmax(self.decision_function(X), axis=1)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) first damaged tooth, 0 for none."""
        return self.decision_function(X).argmax(axis=1)

    def predict_set(self, X: pd.DataFrame) -> BoolArray:
        """(rows, most teeth + 1) whether 'none' and each tooth is in the conformal set of a row.

        Where ``averages`` and ``scatter`` do not tell the noise, sets are those of the noise with the largest ones.
        """
        return self.sets_of_scores(self.decision_function(X), X)

    def sets_of_scores(self, scores: FloatArray, X: pd.DataFrame) -> BoolArray:
        """The same from scores of the rows that are known already."""
        return self._sets(scores, noise_db(X))


def own_groups(groups: ArrayLike | None, rows: int) -> IntArray:
    """Specimens of rows; each row its own where there are none or one, whose rows have to calibrate themselves."""
    known = np.arange(rows) if groups is None else np.asarray(groups)
    return known if len(np.unique(known)) > 1 else np.arange(rows)


def _log_teeth(scores: FloatArray) -> FloatArray:
    """(rows,) logarithm of the tooth count."""
    return np.log(np.isfinite(scores).sum(axis=1))
