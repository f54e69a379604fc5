"""Detection: damaged or not, at a rate of false alarms that is set."""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import ClassifierMixin, clone
from sklearn.frozen import FrozenEstimator
from sklearn.utils.validation import check_is_fitted

from sigdb.core import BoolArray, FloatArray, InputError, IntArray, NotApplicableError
from sigdb.recognition.answers import Answers, damage_score
from sigdb.recognition.calibration.alarm_threshold import alarm_threshold, rows_needed
from sigdb.recognition.calibration.probabilities import specimen_folds_of
from sigdb.recognition.calibration.unfit_reasons import fit_thresholds, unfit_reasons
from sigdb.recognition.estimators.contract import Estimator, Labels, Scorer, specimens_of, tooth_and_severity
from sigdb.recognition.rows.batch import Batch, Column, Reducer, Rows
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.scores import TemplateScores

_MOST_BANDS = 10
_ALARMS_A_BAND = 30
"""False alarms that a band's healthy rows are expected to raise, at least: fewer bound their rate too loosely."""

_LEAST_BAND = 1.0
"""Width of a band of noise at least, dB."""


class Detector(ClassifierMixin, Estimator):
    """Detection of damage: 1 for a damaged gear, 0 for a healthy one.

    The score is the logarithm of the odds of damage at any tooth against none, ``logsumexp(s_1, s_2, ...) - s_0``, with
    s the scores of an estimator of location. Healthy rows of further specimens exceed the threshold at the set rate at
    most. This rate is an average over specimens and over the conditions of the healthy training rows, and holds with
    the stated confidence over the choice of the training specimens (:func:`.alarm_threshold`).

    Scores of two trainings are not on one scale: where the classes are far apart, those of boosted trees differ more
    between trainings than between healthy rows. So a copy's scores are carried to the scale of the trained scorer by
    their ranks among the scores of rows that both were trained on.

    Since the scores of healthy rows depend on their noise, each of several bands of noise has a threshold of its own.
    So the rate holds in each band, not only over all. Bands have equally many rows; between their medians the threshold
    is interpolated in the logarithm of the noise. There are as many bands as the rows allow: each must be 1 dB wide and
    raise thirty false alarms on average.

    Parameters
    ----------
    scorer
        Estimator of location with ``decision_function``. A copy of it is trained. The threshold is then set on scores
        of copies that have not seen the specimen. To use a trained estimator as it is, put it in a
        ``sklearn.frozen.FrozenEstimator``; the rows to fit on must then be of specimens that it has not seen.
    false_alarm_rate
        Rate of false alarms, between 0 and 1.
    confidence
        Confidence of the statement, between 0 and 1.
    folds
        Number of parts of the specimens. A copy of the scorer, trained on the other parts, scores each part.

    Attributes
    ----------
    scorer_
        The trained scorer.
    noise_, thresholds_
        (bands,) noise of an average (unit of the signal; nan where it is not known) and greatest score of a row that
        counts as healthy there.
    reduced_chi2_threshold_, surprise_threshold_
        Greatest reduced chi-square, and greatest surprise of the residual, of a row that is not outside the database,
        where the scores are of templates. Models of earlier versions have no surprise.
    healthy_rows_, healthy_specimens_
        Number of rows and of specimens that they were set on.
    """

    def __init__(
        self, scorer: Scorer, false_alarm_rate: float = 0.01, confidence: float = 0.95, folds: int = 5
    ) -> None:
        self.scorer = scorer
        self.false_alarm_rate = false_alarm_rate
        self.confidence = confidence
        self.folds = folds

    @classmethod
    def of(cls, location: Estimator, false_alarm_rate: float) -> Self:
        """Return an unfitted detector by the scores of an estimator of location."""
        scorer = location.detector_scorer()
        return cls(scorer, false_alarm_rate, folds=scorer.detector_folds)

    @property
    def reads(self) -> frozenset[Column]:  # type: ignore[override]
        """Columns that its scorer reads."""
        return self.scorer.reads

    @property
    def columns(self) -> tuple[Column, ...]:  # type: ignore[override]
        """Further columns that its scorer reads."""
        return self.scorer.columns

    @property
    def learns_from_all(self) -> bool:
        """Whether it is trained on all rows."""
        return self.scorer.learns_from_all

    @property
    def reducer(self) -> Reducer | None:
        """Reducer of averages of its scorer."""
        return getattr(self.scorer, "reducer", None)

    @property
    def template_bank(self) -> TemplateBank | None:
        """Bank of templates that its scorer carries."""
        return self.scorer.template_bank

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Train the scorer, and set the thresholds on the healthy rows.

        Parameters
        ----------
        X
            Rows as the scorer takes them. Where they have ``scatter`` (unit of the signal) and ``averages``, these give
            the noise: ``scatter / sqrt(averages)``.
        y
            First damaged tooth, 0 for healthy rows; or a frame with ``tooth``.
        groups
            Specimen of each row; each row counts as its own if left out.

        Raises
        ------
        InputError
            If the rate or the confidence is not between 0 and 1.
        NotApplicableError
            If the healthy rows do not support the rate.
        """
        for name in ("false_alarm_rate", "confidence"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(f"{name} = {getattr(self, name):g} must be between 0 and 1, such as 0.01 or 0.95")
        tooth = tooth_and_severity(y)[0]
        groups = specimens_of(groups, len(tooth))
        healthy = tooth == 0
        self.scorer_ = clone(self.scorer).fit(X, tooth, groups)
        score = self._unseen(X, tooth, groups)[healthy]
        self.classes_ = np.array([0, 1])
        self.healthy_rows_, self.healthy_specimens_ = len(score), len(np.unique(groups[healthy]))
        if isinstance(self.reducer, TemplateScores):
            thresholds = fit_thresholds(self.reducer, self._batch(X), tooth)
            self.reduced_chi2_threshold_, self.surprise_threshold_ = thresholds
        self.noise_, self.thresholds_ = self._thresholds(score, self._noise(X)[healthy], groups[healthy])
        return self

    def _noise(self, X: Rows) -> FloatArray:
        """Return the noise of each average, (rows,); by templates the effective one."""
        reducer = self.reducer
        return reducer.noise(self._batch(X)) if isinstance(reducer, TemplateScores) else Batch.from_rows(X).noise()

    def _unseen(self, X: Rows, tooth: IntArray, groups: IntArray) -> FloatArray:
        """Return scores by scorers that have not seen the specimen, on the scale of the trained one; (rows,)."""
        trained = damage_score(self.scorer_.decision_function(X))
        if isinstance(self.scorer, FrozenEstimator):
            return trained
        score = np.empty(len(tooth))
        for inner, outer in specimen_folds_of(groups, self.folds):
            scorer = clone(self.scorer).fit(X.take(inner), tooth[inner], groups[inner])
            copied = damage_score(scorer.decision_function(X))
            score[outer] = _on_scale(copied[outer], copied[inner], trained[inner])
        return score

    def _thresholds(self, score: FloatArray, noise: FloatArray, groups: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return noise and threshold of each band, for as many bands as the rows support."""
        for count in range(self._most_bands(noise), 0, -1):
            band = np.zeros(len(noise), int)
            if count > 1:
                band = np.digitize(noise, np.quantile(noise, np.linspace(0, 1, count + 1)[1:-1]))
            bands = [np.flatnonzero(band == k) for k in range(count)]
            thresholds = np.array(
                [
                    alarm_threshold(score[some], groups[some], self.false_alarm_rate, confidence=self.confidence)
                    for some in bands
                ]
            )
            if np.isfinite(thresholds).all():
                return np.array([np.median(noise[some]) for some in bands]), thresholds
        rate, sure = self.false_alarm_rate, self.confidence
        raise NotApplicableError(
            f"false_alarm_rate = {rate:g} at a confidence of {sure:g} needs {rows_needed(rate, sure)} independent "
            f"healthy rows; X has {len(score)} healthy rows of {len(np.unique(groups))} specimens, which count as "
            "fewer; give more specimens and healthy rows, or set a greater rate"
        )

    def _most_bands(self, noise: FloatArray) -> int:
        if not (len(noise) and np.isfinite(noise).all()):
            return 1
        width = 20 * np.log10(noise.max() / noise.min())
        by_rows = self.false_alarm_rate * len(noise) / _ALARMS_A_BAND
        return int(np.clip(min(by_rows, width / _LEAST_BAND), 1, _MOST_BANDS))

    def fits_none(self, X: Rows) -> BoolArray | None:
        """Return whether no template fits a row, (rows,); None if the scores are not of templates."""
        reasons = self.unfit_reasons(X)
        return None if reasons is None else np.array([bool(reason) for reason in reasons])

    def unfit_reasons(self, X: Rows) -> list[str] | None:
        """Return why no template fits a row, empty where one does; None as :meth:`fits_none`."""
        threshold, reducer = getattr(self, "reduced_chi2_threshold_", None), self.reducer
        if threshold is None or not isinstance(reducer, TemplateScores):
            return None
        surprise = getattr(self, "surprise_threshold_", np.inf)
        return unfit_reasons(reducer, self._batch(X), reduced_chi2=threshold, surprise=surprise)

    def log_ratio(self, X: Rows) -> FloatArray:
        """Return the logarithm of the odds of damage against none, by the scorer; (rows,)."""
        check_is_fitted(self)
        return damage_score(self.scorer_.decision_function(X))

    def decision_function(self, X: Rows) -> FloatArray:
        """Return by how much the logarithm of the odds is above the threshold, (rows,); unbounded."""
        score = self.log_ratio(X)
        if len(self.thresholds_) == 1:
            return score - self.thresholds_[0]
        noise = np.log(self._noise(X))
        return np.asarray(score - np.interp(noise, np.log(self.noise_), self.thresholds_))

    def predict(self, X: Rows) -> IntArray:
        """Return 1 for damage, 0 for none; (rows,)."""
        return (self.decision_function(X) > 0).astype(int)

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with scores of damage."""
        scores = self.decision_function(X)
        return Answers(predicted=(scores > 0).astype(int), scores=scores)


def _on_scale(scores: FloatArray, source: FloatArray, target: FloatArray) -> FloatArray:
    """Return scores of one scorer on the scale of another, by rank.

    Parameters
    ----------
    scores
        (n,) scores of a scorer.
    source, target
        (rows,) scores of the same rows, by this scorer and by the other one.

    Returns
    -------
    ndarray
        (n,) for the k-th least score of ``source`` the k-th least of ``target``, the greatest of these for tied ranks;
        between those scores on a straight line, beyond them by the distance.
    """
    values, counts = np.unique(source, return_counts=True)
    inside = np.clip(scores, values[0], values[-1])
    return np.asarray(np.interp(inside, values, np.sort(target)[np.cumsum(counts) - 1]) + (scores - inside))
