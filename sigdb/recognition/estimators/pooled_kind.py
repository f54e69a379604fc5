"""Kind of damage from pooled features, seen from the tooth that looks damaged most, and the most frequent kind."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.special import softmax
from sklearn.base import ClassifierMixin, clone
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.database import KIND, kind_classes, places_of_kinds
from sigdb.recognition.answers import Answers
from sigdb.recognition.calibration.cells import points_of
from sigdb.recognition.calibration.location_sets import LocationSets, strangeness
from sigdb.recognition.calibration.probabilities import calibrate, check_labels, specimen_folds_of, with_none
from sigdb.recognition.estimators.contract import Estimator, Labels, Scorer, tooth_and_severity
from sigdb.recognition.estimators.pooled_location import (
    FOLDS,
    LocationClassifier,
    PooledEstimator,
    own_groups,
    pooled_learner,
)
from sigdb.recognition.rows.batch import Batch, Column, Rows


class KindClassifier(PooledEstimator, LocationSets, ClassifierMixin, Scorer):
    """Kind of damage: ``none``, or the names of all kinds that the damaged tooth has.

    A classifier of location names the tooth that looks damaged most, in every row. For each kind a binary scorer learns
    to distinguish the view from the damaged tooth of its rows from those of other kinds, and from the views of healthy
    rows. The answer is a softmax over the scores of all kinds and of 'none', calibrated as by
    :class:`LocationClassifier`, with sets of kinds in the place of sets of teeth. Turning the signature does not change
    the answer.

    Parameters
    ----------
    learner
        ``"lda"`` (shrinkage linear discriminant analysis) or ``"boosting"`` (gradient boosting of histograms).
    random_state
        Seed.
    coverage
        Nominal coverage of the sets. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer every
        set holds every kind.
    columns
        Further columns of ``features`` that views hold, see :class:`ToothViews`.
    coverage_by
        ``cell`` or ``all``: whether coverage holds in each cell or on average over all rows.

    Attributes
    ----------
    classes_
        Kinds, ``none`` first.
    slope_, none_
        Slope of the scores, and level of 'none'.
    prevalence_
        Share of damaged rows that the level is for.
    set_edges_, set_thresholds_
        As of :class:`LocationSets`.
    """

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Train on rows of features.

        Parameters
        ----------
        X
            Rows with the columns ``teeth``, ``speed_rpm``, ``torque``, ``wigner_ville``; for sets that follow the noise
            also ``averages`` and ``scatter``.
        y
            A frame with ``tooth``, ``kind`` and the severities of each row.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        batch, labels = self._batch(X), _kinds_and_teeth(y)
        groups, classes = own_groups(groups, len(batch)), kind_classes(labels[KIND])
        as_teeth = kind_labels(labels, classes)
        place, severity = tooth_and_severity(as_teeth)
        check_labels(np.full(len(batch), len(classes) - 1), place)
        self.classes_, tooth = np.array(classes), labels["tooth"].to_numpy(int)
        self.prevalence_ = float((place > 0).mean())
        scores = np.empty((len(batch), len(classes) - 1))
        for inner, outer in specimen_folds_of(groups, FOLDS):
            other = clone(self)._learn(batch.take(inner), tooth[inner], place[inner], len(classes))
            scores[outer] = other._kind_scores(batch.take(outer))
        self.slope_, self.none_ = calibrate(scores, place)
        strange = strangeness(scores, place, groups)
        self._fit_sets(strange, place, severity, point=points_of(batch), noise=batch.noise_db(), groups=groups)
        return self._learn(batch, tooth, place, len(classes))

    def _learn(self, batch: Batch, tooth: IntArray, place: IntArray, classes: int) -> Self:
        """Train the classifier of location, and a scorer of each kind on views; ``place`` is that of the kind."""
        location = LocationClassifier(self.learner, self.random_state, columns=self.columns)
        self.location_ = location.fit_scorer(batch, tooth)
        seen = self._views(batch, np.where(tooth > 0, tooth, self._tooth(batch)))
        scorer = pooled_learner(self.learner).scorer
        self.scorers_ = [scorer(self.random_state).fit(seen, place == kind) for kind in range(1, classes)]
        return self

    def _tooth(self, batch: Batch) -> IntArray:
        return 1 + self.location_.tooth_scores(batch).argmax(axis=1)

    def _views(self, batch: Batch, tooth: IntArray) -> FloatArray:
        return self.location_.views_.view_from(batch, tooth)

    def _kind_scores(self, batch: Batch) -> FloatArray:
        seen = self._views(batch, self._tooth(batch))
        return np.column_stack([scorer.decision_function(seen) for scorer in self.scorers_])

    def decision_function(self, X: Rows) -> FloatArray:
        """Return unbounded scores of the kinds, (rows, kinds); their softmax is the probability."""
        check_is_fitted(self)
        return with_none(self._kind_scores(self._batch(X)), self.slope_, self.none_)

    def predict_proba(self, X: Rows) -> FloatArray:
        """Return the probability of each kind, (rows, kinds)."""
        return softmax(self.decision_function(X), axis=1)

    def predict(self, X: Rows) -> NDArray[np.str_]:  # type: ignore[override]
        """Return the most probable kind of each row, ``none`` for none; (rows,)."""
        return self.classes_[self.decision_function(X).argmax(axis=1)]

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with scores, probabilities and sets of kinds."""
        batch = self._batch(X)
        scores = self.decision_function(batch)
        sets = self._sets(scores, batch.noise_db())
        return Answers.of_scores(scores, sets=sets, classes=tuple(self.classes_.tolist()))


class MajorityKind(ClassifierMixin, Estimator):
    """Always the most frequent kind of the training rows."""

    reads = frozenset[Column]()

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Count the kinds."""
        kinds = _kinds_and_teeth(y)[KIND]
        self.classes_ = np.array(kind_classes(kinds))
        self.answer_ = str(kinds.value_counts().idxmax())
        return self

    def predict(self, X: Rows) -> NDArray[np.str_]:  # type: ignore[override]
        """Return the same kind for every row, (rows,)."""
        return np.full(len(X), self.answer_)

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows."""
        place = self.classes_.tolist().index(self.answer_)
        return Answers(predicted=np.full(len(X), place), classes=tuple(self.classes_.tolist()))


def kind_labels(y: Labels, classes: tuple[str, ...]) -> pd.DataFrame:
    """Return labels of kinds as those of teeth: the place of each row's kind as ``tooth``, and the severities.

    Raises
    ------
    InputError
        If the labels are no frame with kinds, or there is a kind that is not among the classes.
    """
    labels = _kinds_and_teeth(y)
    places = places_of_kinds(labels[KIND], classes)
    if (places < 0).any():
        kind = labels[KIND].iloc[int((places < 0).argmax())]
        raise InputError(f"y holds the kind {kind!r}, which is none of {', '.join(classes)}")
    return labels.drop(columns=KIND).assign(tooth=places)


def _kinds_and_teeth(y: Labels) -> pd.DataFrame:
    if not isinstance(y, pd.DataFrame) or not {KIND, "tooth"} <= {*y}:
        raise InputError("y has no kinds of damage; give a frame with tooth, kind and the severities of each row")
    return y
