"""Detection: damaged or not, at a rate of false alarms that is set."""

from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.frozen import FrozenEstimator
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray, InputError, IntArray
from sigdb.recognition.answers import damage_score
from sigdb.recognition.calibration.alarm_threshold import alarm_threshold, rows_needed
from sigdb.recognition.calibration.probabilities import specimen_folds_of

_MOST_BANDS = 10
_ALARMS_A_BAND = 30
"""False alarms that a band's healthy rows are expected to raise, at least: fewer bound their rate too loosely."""

_LEAST_BAND = 1.0
"""Width of a band of noise at least, dB."""


class Detector(ClassifierMixin, BaseEstimator):
    """Detection of damage: 1 for a damaged gear, 0 for a healthy one.

    The score is the logarithm of the odds of damage at any tooth against none, ``logsumexp(s_1, s_2, ...) - s_0``, s
    the scores of an estimator of location. A healthy row of a further specimen is above the threshold at the set rate
    at most: with the stated confidence over the choice of the training specimens, on average over specimens and over
    the conditions of the healthy training rows (:func:`.alarm_threshold`). Since the
    scores of healthy rows depend on their noise, the threshold is set in bands of noise of equally many rows and
    interpolated between their medians, in the logarithm of the noise; the rate so holds in each band, not only over
    all. How many bands there are depends on the rows: each is to raise thirty false alarms, and is 1 dB wide at least.

    Parameters
    ----------
    scorer
        Estimator of location with ``decision_function``. A copy of it is trained; the threshold is then set on scores
        of copies that have not seen the specimen they judge. One that is trained already is taken as it is in a
        ``sklearn.frozen.FrozenEstimator``; the rows to fit on must then be of specimens that it has not seen.
    false_alarm_rate
        Rate of false alarms, between 0 and 1.
    confidence
        Confidence of the statement, between 0 and 1.
    folds
        Parts of the specimens, each judged by a copy of the scorer that the others have taught.

    Attributes
    ----------
    scorer_
        The trained scorer.
    noise_, thresholds_
        (bands,) noise of an average (unit of the signal; nan where it is not known) and greatest score that is called
        healthy there.
    healthy_rows_, healthy_specimens_
        What they were set on.
    """

    def __init__(self, scorer: Any, false_alarm_rate: float = 0.01, confidence: float = 0.95, folds: int = 5) -> None:
        self.scorer = scorer
        self.false_alarm_rate = false_alarm_rate
        self.confidence = confidence
        self.folds = folds

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Train the scorer, and set the thresholds on the healthy rows.

        Parameters
        ----------
        X
            Rows as the scorer takes them. Where they have ``scatter`` (unit of the signal) and ``averages``, these tell
            the noise: ``scatter / sqrt(averages)``.
        y
            First damaged tooth, 0 for healthy rows.
        groups
            Specimen of each row; each row counts as its own if left out.

        Raises
        ------
        InputError
            If the rate or the confidence is not between 0 and 1, or the healthy rows do not support the rate.
        """
        for name in ("false_alarm_rate", "confidence"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(f"{name} = {getattr(self, name):g} must be between 0 and 1, such as 0.01 or 0.95")
        y = np.asarray(y, dtype=int)
        groups = np.arange(len(y)) if groups is None else np.asarray(groups)
        healthy = y == 0
        score = self._unseen(X, y, groups)[healthy]
        self.scorer_ = clone(self.scorer).fit(X, y, groups)
        self.classes_ = np.array([0, 1])
        self.healthy_rows_, self.healthy_specimens_ = len(score), len(np.unique(groups[healthy]))
        self.noise_, self.thresholds_ = self._thresholds(score, noise_of(X)[healthy], groups[healthy])
        return self

    def _unseen(self, X: pd.DataFrame, y: IntArray, groups: IntArray) -> FloatArray:
        """(rows,) scores by a scorer that has not seen the specimen."""
        if isinstance(self.scorer, FrozenEstimator):
            return damage_score(self.scorer.decision_function(X))
        score = np.empty(len(y))
        for inner, outer in specimen_folds_of(groups, self.folds):
            scorer = clone(self.scorer).fit(X.iloc[inner], y[inner], groups[inner])
            score[outer] = damage_score(scorer.decision_function(X.iloc[outer]))
        return score

    def _thresholds(self, score: FloatArray, noise: FloatArray, groups: IntArray) -> tuple[FloatArray, FloatArray]:
        """Noise and threshold of each band, of as many bands as the rows support."""
        for count in range(self._most_bands(noise), 0, -1):
            band = np.zeros(len(noise), int)
            if count > 1:
                band = np.digitize(noise, np.quantile(noise, np.linspace(0, 1, count + 1)[1:-1]))
            bands = [np.flatnonzero(band == k) for k in range(count)]
            found = np.array(
                [
                    alarm_threshold(score[some], groups[some], self.false_alarm_rate, confidence=self.confidence)
                    for some in bands
                ]
            )
            if np.isfinite(found).all():
                return np.array([np.median(noise[some]) for some in bands]), found
        rate, sure = self.false_alarm_rate, self.confidence
        raise InputError(
            f"false_alarm_rate = {rate:g} at a confidence of {sure:g} needs {rows_needed(rate, sure)} healthy rows "
            f"that do not depend on each other; X has {len(score)} of {len(np.unique(groups))} specimens, which are "
            "worth fewer; give more specimens and healthy rows, or ask for a greater rate"
        )

    def _most_bands(self, noise: FloatArray) -> int:
        if not (len(noise) and np.isfinite(noise).all()):
            return 1
        width = 20 * np.log10(noise.max() / noise.min())
        by_rows = self.false_alarm_rate * len(noise) / _ALARMS_A_BAND
        return int(np.clip(min(by_rows, width / _LEAST_BAND), 1, _MOST_BANDS))

    def log_ratio(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) logarithm of the odds of damage against none, by the scorer."""
        check_is_fitted(self)
        return damage_score(self.scorer_.decision_function(X))

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) by how much the logarithm of the odds is above the threshold; unbounded."""
        score = self.log_ratio(X)
        if len(self.thresholds_) == 1:
            return score - self.thresholds_[0]
        return np.asarray(score - np.interp(np.log(noise_of(X)), np.log(self.noise_), self.thresholds_))

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) 1 for damage, 0 for none."""
        return (self.decision_function(X) > 0).astype(int)


def noise_of(X: pd.DataFrame) -> FloatArray:
    """(rows,) standard deviation of the noise of each average, from the scatter between its revolutions; nan where that
    is not known."""
    if not {"scatter", "averages"} <= set(X.columns):
        return np.full(len(X), np.nan)
    noise = X["scatter"].to_numpy(float) / np.sqrt(X["averages"].to_numpy(float))
    return np.where(noise > 0, noise, np.nan)
