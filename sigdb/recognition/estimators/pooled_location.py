"""Damage location by construction: one scorer looks at one tooth, and is turned around the gear."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
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

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, blocks
from sigdb.recognition.answers import Answers
from sigdb.recognition.calibration.cells import band_edges, bands, points_of
from sigdb.recognition.calibration.conformal import BY_CELL, COVERAGE, rows_by_cell
from sigdb.recognition.calibration.location_sets import LocationSets, strangeness
from sigdb.recognition.calibration.probabilities import calibrate, check_labels, specimen_folds_of, with_none
from sigdb.recognition.estimators.contract import Labels, Scorer, specimens_of, tooth_and_severity
from sigdb.recognition.rows.batch import NOISE, ROWS_AT_ONCE, Batch, Column, Rows
from sigdb.recognition.rows.tooth_views import COLUMNS, ToothViews
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank


@dataclass(frozen=True, kw_only=True)
class PooledLearner:
    """A way to learn from pooled features.

    Attributes
    ----------
    scorer
        Function of a seed that returns an unfitted binary classifier of the views of teeth, with a
        ``decision_function``.
    regressor
        Function of a seed that returns an unfitted regressor of a severity.
    """

    scorer: Callable[[int], BaseEstimator]
    regressor: Callable[[int], BaseEstimator]


def _ridge(random_state: int) -> BaseEstimator:
    # Columns that do not vary, such as the speed of one operating point, have no scale.
    return make_pipeline(VarianceThreshold(), StandardScaler(), RidgeCV(alphas=(1.0, 10.0, 100.0, 1000.0)))


_BOOSTED = {"max_iter": 100, "early_stopping": False}

POOLED_LEARNERS = {
    "lda": PooledLearner(
        scorer=lambda random_state: LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto"), regressor=_ridge
    ),
    "boosting": PooledLearner(
        scorer=lambda random_state: HistGradientBoostingClassifier(**_BOOSTED, random_state=random_state),
        regressor=lambda random_state: HistGradientBoostingRegressor(**_BOOSTED, random_state=random_state),
    ),
}
"""Learners from pooled features by name."""


def pooled_learner(name: str) -> PooledLearner:
    """Return a learner from pooled features.

    Raises
    ------
    InputError
        If there is none of this name.
    """
    if name not in POOLED_LEARNERS:
        raise InputError(f"learner = {name!r} is not known; choose one of {', '.join(POOLED_LEARNERS)}")
    return POOLED_LEARNERS[name]


FOLDS = 2
"""Number of parts of the specimens. A scorer that is trained on the other parts scores each part."""


class PooledEstimator:
    """Parameters and columns of an estimator that learns from pooled features.

    Parameters
    ----------
    learner
        Name of one of `POOLED_LEARNERS`.
    random_state
        Seed.
    coverage
        Nominal coverage of sets or intervals.
    columns
        Further columns of ``features`` that views hold, see :class:`ToothViews`.
    coverage_by
        ``cell`` or ``all``: whether coverage holds in each cell or on average over all rows.
    """

    reads = COLUMNS | frozenset(NOISE)
    optional = frozenset(NOISE)

    def __init__(
        self,
        learner: str = "boosting",
        random_state: int = 0,
        coverage: float = COVERAGE,
        columns: tuple[Column, ...] = (),
        coverage_by: str = BY_CELL,
    ) -> None:
        self.learner = learner
        self.random_state = random_state
        self.coverage = coverage
        self.columns = columns
        self.coverage_by = coverage_by

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted estimator with the learner of this name."""
        return cls(name, settings.seed, columns=settings.columns, coverage_by=settings.coverage_by)


class LocationClassifier(PooledEstimator, LocationSets, ClassifierMixin, Scorer):
    """Location of damage: 0 for none, else the first damaged tooth.

    A binary scorer, shared by all teeth, learns to distinguish the view from the first damaged tooth from views of
    other teeth and of healthy gears. The answer is a softmax over the scores of all teeth and of 'none'. The slope of
    the scores, the level of 'none' and the thresholds of conformal sets (:class:`LocationSets`) are set on scores of
    specimens that the scorer had not seen. Each band of the noise, in dB of the sensor's unit, has its own. Then the
    scorer learns from all specimens.

    Turning the signature by j teeth turns the answer by j teeth exactly. A gear of a tooth count that was never seen
    has an answer too. Each of Z teeth has the prior odds ``1 / (r Z)`` against none, where r is the odds of none
    against damage. So the level of 'none' is ``none_ + log Z``.

    Parameters
    ----------
    learner
        ``"lda"`` (shrinkage linear discriminant analysis) or ``"boosting"`` (gradient boosting of histograms).
    random_state
        Seed of the choice of views from other teeth, and of boosting.
    coverage
        Nominal coverage of the sets. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer every
        set holds every answer.
    columns
        Further columns of ``features`` that views hold, see :class:`ToothViews`.
    coverage_by
        ``cell`` or ``all``: whether coverage holds in each cell or on average over all rows.

    Attributes
    ----------
    slope_, none_
        (1 + bands,) slope of the scores, and level of 'none' without log Z: of all rows, for records whose noise is not
        known, then of each band.
    prevalence_
        Share of damaged rows that the level is for.
    set_edges_, set_thresholds_
        As of :class:`LocationSets`.
    """

    detector_folds = 2  # it takes long to train

    _OTHER_TEETH = 3

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
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
        batch = self._batch(X)
        tooth, severity = tooth_and_severity(y)
        check_labels(batch.table["teeth"].to_numpy(), tooth)
        groups = own_groups(groups, len(batch))
        self.classes_ = np.arange(int(batch.table["teeth"].max()) + 1)
        self.prevalence_ = float((tooth > 0).mean())
        scores = self._unseen_scores(batch, tooth, groups)
        noise = batch.noise_db()
        by_band = rows_by_cell(bands(band_edges(noise, groups, self.coverage), noise))
        strange, levels = np.empty(len(batch)), []
        for at in (np.arange(len(batch)), *by_band):
            prior = _log_teeth(scores[at])
            levels.append(calibrate(scores[at], tooth[at], prior))
            strange[at] = strangeness(scores[at], tooth[at], groups[at], prior)
        self.slope_, self.none_ = np.array(levels).T
        self._fit_sets(strange, tooth, severity, point=points_of(batch), noise=noise, groups=groups)
        return self.fit_scorer(batch, tooth)

    def fit_scorer(self, batch: Batch, tooth: IntArray) -> Self:
        """Train the scorer alone, on rows of features and their first damaged tooth."""
        self.views_ = ToothViews(self.columns).fit(batch)
        self.scorer_ = self._fit_scorer(batch, tooth)
        return self

    def _unseen_scores(self, batch: Batch, tooth: IntArray, groups: IntArray) -> FloatArray:
        """Return scores (rows, most teeth) by scorers that are trained on other specimens."""
        scores = np.full((len(batch), self.classes_[-1]), -np.inf)
        for inner, outer in specimen_folds_of(groups, FOLDS):
            unseen = clone(self).fit_scorer(batch.take(inner), tooth[inner]).tooth_scores(batch.take(outer))
            scores[outer, : unseen.shape[1]] = unseen
        return scores

    def _fit_scorer(self, batch: Batch, tooth: IntArray) -> "_ToothScorer":
        """Train on views from the damaged tooth against a few views from other teeth and from healthy gears."""
        stream = np.random.default_rng(self.random_state)
        seen, labels = [], []
        for teeth, at in batch.by_teeth():
            others = np.argsort(stream.random((len(at), teeth - 1)), axis=1)[:, : self._OTHER_TEETH] + 1
            first = np.maximum(tooth[at], 1) - 1
            columns = (first[:, None] + np.column_stack([np.zeros(len(at), int), others])) % teeth
            seen += [
                np.take_along_axis(views, columns[part][:, :, None], axis=1).reshape(-1, views.shape[2])
                for part, views in self._views_of(batch, at)
            ]
            is_first = np.zeros(columns.shape, bool)
            is_first[:, 0] = tooth[at] > 0
            labels.append(is_first.ravel())
        scorer: _ToothScorer = pooled_learner(self.learner).scorer(self.random_state)
        return scorer.fit(np.concatenate(seen), np.concatenate(labels))

    def tooth_scores(self, X: Rows) -> FloatArray:
        """Return the score of each tooth, (rows, most teeth); -inf where a gear has no such tooth."""
        batch = self._batch(X)
        scores = np.full((len(batch), int(batch.table["teeth"].max())), -np.inf)
        for teeth, at in batch.by_teeth():
            for part, views in self._views_of(batch, at):
                part_scores = self.scorer_.decision_function(views.reshape(-1, views.shape[2]))
                scores[at[part], :teeth] = part_scores.reshape(-1, teeth)
        return scores

    def _views_of(self, batch: Batch, at: IntArray) -> Iterator[tuple[slice, FloatArray]]:
        """Yield views of some rows at once: those of all teeth of many rows would not fit into memory."""
        for part in blocks(len(at), ROWS_AT_ONCE):
            yield part, self.views_.views(batch.take(at[part]))

    def decision_function(self, X: Rows) -> FloatArray:
        """Return unbounded scores of 'none' and of each tooth, (rows, most teeth + 1).

        Their softmax is the probability.
        """
        check_is_fitted(self)
        batch = self._batch(X)
        scores, noise = self.tooth_scores(batch), batch.noise_db()
        band = np.where(np.isfinite(noise), 1 + bands(self.set_edges_, noise), 0)
        return with_none(scores, self.slope_[band], self.none_[band] + _log_teeth(scores))

    def predict_proba(self, X: Rows) -> FloatArray:
        """Return the probability of 'none' and of each tooth, (rows, most teeth + 1)."""
        return softmax(self.decision_function(X), axis=1)

    def predict_set(self, X: Rows) -> BoolArray:
        """Return whether 'none' and each tooth is in the conformal set of a row, (rows, most teeth + 1).

        Where ``averages`` and ``scatter`` do not give the noise, sets are those of the band of noise with the largest
        sets.
        """
        batch = self._batch(X)
        return self._sets(self.decision_function(batch), batch.noise_db())

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with scores, probabilities and sets."""
        batch = self._batch(X)
        scores = self.decision_function(batch)
        return Answers.of_scores(scores, sets=self._sets(scores, batch.noise_db()))


class _ToothScorer(Protocol):
    """A binary classifier of views."""

    def fit(self, X: FloatArray, y: BoolArray) -> Self: ...

    def decision_function(self, X: FloatArray) -> FloatArray: ...


def own_groups(groups: ArrayLike | None, rows: int) -> IntArray:
    """Return the specimens of rows; each row its own where there are none or one, whose rows calibrate themselves."""
    specimens = specimens_of(groups, rows)
    return specimens if len(np.unique(specimens)) > 1 else np.arange(rows)


def _log_teeth(scores: FloatArray) -> FloatArray:
    """Return the logarithm of the tooth count, (rows,)."""
    return np.log(np.isfinite(scores).sum(axis=1))
