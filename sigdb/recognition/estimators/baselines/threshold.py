"""Baselines of location and severity: a threshold of an indicator, and the most frequent answer."""

from abc import abstractmethod
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.signal import hilbert
from sklearn.base import ClassifierMixin, RegressorMixin, clone
from sklearn.isotonic import IsotonicRegression
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.answers import Answers
from sigdb.recognition.estimators.contract import (
    Estimator,
    Labels,
    Scorer,
    SeverityEstimator,
    severity_labels,
    tooth_and_severity,
)
from sigdb.recognition.rows.batch import POINT, TSA, Batch, Column, Reducer, Rows
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.signature import residual_signal

FALSE_ALARM_RATE = 0.01


class ThresholdLocation(ClassifierMixin, Estimator):
    """Damage where an indicator exceeds the value that a set share of the healthy training rows exceeds.

    The tooth is the one that the indicator names. If it names none, the tooth is the most frequent one of the training
    rows.

    Parameters
    ----------
    false_alarm_rate
        Share of the healthy training rows that exceed the threshold.
    """

    def __init__(self, false_alarm_rate: float = FALSE_ALARM_RATE) -> None:
        self.false_alarm_rate = false_alarm_rate

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted baseline at the false-alarm rate of the settings."""
        return cls(settings.false_alarm_rate)

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Set the threshold.

        Parameters
        ----------
        X
            Rows with the columns that the indicator needs.
        y
            First damaged tooth, 0 for none; or a frame with ``tooth``.
        groups
            Not used.
        """
        tooth = tooth_and_severity(y)[0]
        self.classes_ = np.unique(tooth)
        healthy = self._batch(X).take(tooth == 0)
        self._learn(healthy)
        self.threshold_ = float(np.quantile(self.indicator(healthy), 1 - self.false_alarm_rate))
        teeth, counts = np.unique(tooth[tooth > 0], return_counts=True)
        self.tooth_ = int(teeth[counts.argmax()])
        return self

    def _learn(self, healthy: Batch) -> None:
        """Learn the reference of the indicator."""

    @abstractmethod
    def indicator(self, X: Rows) -> FloatArray:
        """Return the indicator, greater for damage, (rows,)."""

    def tooth(self, X: Rows) -> IntArray:
        """Return the tooth that each row gets if it counts as damaged, (rows,)."""
        return np.full(len(X), self.tooth_)

    def predict(self, X: Rows) -> IntArray:
        """Return 0 up to the threshold, else the tooth; (rows,)."""
        return np.asarray(self.answer(X).predicted)

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with the indicator for the score of damage."""
        check_is_fitted(self)
        batch = self._batch(X)
        indicator = self.indicator(batch)
        return Answers(predicted=np.where(indicator > self.threshold_, self.tooth(batch), 0), scores=indicator)

    def detector_scorer(self) -> "IndicatorScore":
        """Return the indicator as a score of damage."""
        return IndicatorScore(self)


class IndicatorScore(Scorer):
    """The indicator of a baseline as the score of damage, whichever the tooth, with 0 for none.

    Parameters
    ----------
    baseline
        A baseline; a copy of it is fitted.
    """

    def __init__(self, baseline: ThresholdLocation) -> None:
        self.baseline = baseline

    @property
    def reads(self) -> frozenset[Column]:  # type: ignore[override]
        """Columns that the baseline reads."""
        return self.baseline.reads

    @property
    def reducer(self) -> Reducer | None:
        """Reducer of averages of the baseline; None where it reads no averages."""
        return self.baseline.reducer

    @property
    def template_bank(self) -> TemplateBank | None:
        """Bank of templates that the baseline carries."""
        return self.baseline.template_bank

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Fit the baseline."""
        self.baseline_ = clone(self.baseline).fit(X, y, groups)
        return self

    def decision_function(self, X: Rows) -> FloatArray:
        """Return 0 and the indicator, (rows, 2)."""
        indicator = self.baseline_.indicator(X)
        return np.column_stack([np.zeros_like(indicator), indicator])


class MajorityLocation(ClassifierMixin, Estimator):
    """Always the most frequent class of the training rows."""

    reads = frozenset[Column]()

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Count the classes."""
        self.classes_, counts = np.unique(tooth_and_severity(y)[0], return_counts=True)
        self.answer_ = int(self.classes_[counts.argmax()])
        return self

    def predict(self, X: Rows) -> IntArray:
        """Return the same answer for every row, (rows,)."""
        return np.full(len(X), self.answer_)


class MajoritySeverity(RegressorMixin, SeverityEstimator):
    """Always the median of the damaged training rows."""

    reads = frozenset[Column]()

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Take the medians."""
        labels = severity_labels(y)
        medians = labels[labels["tooth"] > 0].drop(columns="tooth").median()
        self.quantities_, self.medians_ = tuple(map(str, medians.index)), medians.to_numpy(float)
        return self

    def predict(self, X: Rows) -> pd.DataFrame:
        """Return the same estimates for every row."""
        return pd.DataFrame([self.medians_] * len(X), columns=list(self.quantities_), index=X.index)


class Fm4Location(ThresholdLocation):
    """Damage where FM4 exceeds the value that one healthy training row in a hundred, or another set share, exceeds.

    FM4 is the same for any tooth and names none, so the tooth is the most frequent one.
    """

    reads = frozenset({"fm4"})

    def indicator(self, X: Rows) -> FloatArray:
        """Return FM4, (rows,)."""
        return self._batch(X).column("fm4")


class Fm4Severity(RegressorMixin, SeverityEstimator):
    """Each severity as a monotonic function of FM4 alone."""

    reads = frozenset({"fm4"})

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Fit one isotonic regression for each severity to the damaged rows."""
        labels = severity_labels(y)
        damaged = (labels["tooth"] > 0).to_numpy()
        fm4 = self._batch(X).column("fm4")[damaged]
        true = labels.drop(columns="tooth")[damaged]
        self.quantities_ = tuple(map(str, true.columns))
        has = true.notna().to_numpy()
        self.regressors_ = [_monotonic(fm4[some], true.to_numpy(float)[some, i]) for i, some in enumerate(has.T)]
        return self

    def predict(self, X: Rows) -> pd.DataFrame:
        """Return estimates for each row."""
        fm4 = self._batch(X).column("fm4")
        return pd.DataFrame(
            {name: regressor.predict(fm4) for name, regressor in zip(self.quantities_, self.regressors_, strict=True)},
            index=X.index,
        )


def _monotonic(fm4: FloatArray, severity: FloatArray) -> IsotonicRegression:
    """Return an isotonic regression, rising or falling as the two vary together."""
    together = float(((fm4 - fm4.mean()) * (severity - severity.mean())).sum())
    return IsotonicRegression(increasing=together >= 0, out_of_bounds="clip").fit(fm4, severity)


class EnvelopePeak:
    """Averages to the crest of the envelope of their residual, and the tooth in whose pass it is."""

    column = "envelope_peak"

    def transform(self, X: Batch) -> FloatArray:
        """Return two numbers of each row, (rows, 2).

        They are the greatest modulus of the analytic residual over its root mean square, no unit, and the tooth,
        numbered from 1.
        """
        peaks = np.empty((len(X), 2))
        for teeth, at, x in X.averages():
            envelope = np.abs(hilbert(residual_signal(x, teeth=teeth)))
            peak = envelope.argmax(axis=1)
            rms = np.sqrt((envelope**2).mean(axis=1)).clip(min=np.finfo(float).tiny)
            peaks[at] = np.column_stack([envelope.max(axis=1) / rms, 1 + peak * teeth // x.shape[1]])
        return peaks


class EnvelopeLocation(ThresholdLocation):
    """The tooth whose pass holds the peak of the residual's envelope; none where the peak is no higher than usual.

    The peak is measured in root mean squares of the envelope. A set share of the healthy training rows exceeds the
    threshold. A peak comes at or after the first damaged tooth, so that neighbouring damaged teeth are often taken for
    one another.
    """

    reads = frozenset({"teeth", TSA})
    reducer: Reducer = EnvelopePeak()

    def indicator(self, X: Rows) -> FloatArray:
        """Return peak over root mean square, no unit, (rows,)."""
        return self._batch(X).reduce(self.reducer)[:, 0]

    def tooth(self, X: Rows) -> IntArray:
        """Return the tooth in whose pass the peak is, (rows,)."""
        return self._batch(X).reduce(self.reducer)[:, 1].astype(int)


class ResidualMoments:
    """Averages to the second and the fourth moment of their residual r: ``mean r^2``, ``mean r^4``."""

    column = "residual_moments"

    def transform(self, X: Batch) -> FloatArray:
        """Return the moments, (rows, 2), in the signal's unit to the second and the fourth."""
        moments = np.empty((len(X), 2))
        for teeth, at, x in X.averages():
            square = residual_signal(x, teeth=teeth) ** 2
            moments[at] = np.column_stack([square.mean(axis=1), (square**2).mean(axis=1)])
        return moments


_POINT = ["teeth", "speed_rpm", "torque"]


class Na4StarLocation(ThresholdLocation):
    """Damage where NA4* exceeds the value that a set share of the healthy training rows exceeds.

    NA4* is the fourth moment of the residual over the squared mean of the second moment of healthy records
    (:func:`sigdb.signature.na4_star`). A history in time is replaced by the healthy training rows of the same tooth
    count, speed and torque, or of the nearest. It names no tooth, so the tooth is the most frequent one.

    Attributes
    ----------
    points_
        (points, 3) teeth, speed (rpm) and torque (N m) of the healthy training rows.
    baseline_
        (points,) mean second moment of their residuals.
    """

    reads = frozenset({*POINT, TSA})
    reducer: Reducer = ResidualMoments()

    def _learn(self, healthy: Batch) -> None:
        second = pd.Series(healthy.reduce(self.reducer)[:, 0], healthy.index)
        mean = second.groupby([healthy.table[name] for name in _POINT]).mean()
        self.points_, self.baseline_ = mean.index.to_frame().to_numpy(float), mean.to_numpy()

    def indicator(self, X: Rows) -> FloatArray:
        """Return NA4*, no unit, (rows,)."""
        batch = self._batch(X)
        return np.asarray(batch.reduce(self.reducer)[:, 1] / self.baseline_[self._place(batch)] ** 2)

    def _place(self, batch: Batch) -> IntArray:
        """Return the index (rows,) of the nearest operating point, of the nearest tooth count.

        It has the least relative differences in speed and torque.
        """
        points, index = np.unique(batch.table[_POINT].to_numpy(float), axis=0, return_inverse=True)
        with np.errstate(over="ignore"):  # of an unknown torque, which counts as 0
            away = np.abs(points[:, None] - self.points_) / np.maximum(np.abs(self.points_), np.finfo(float).tiny)
        # Another tooth count is another gear: it comes last, however near speed and torque are.
        distance = np.hypot(away[..., 1], away[..., 2]) + 1e6 * away[..., 0]
        return np.asarray(distance.argmin(axis=1)[index.ravel()])
