"""What baselines of location share: damage where an indicator is above a threshold."""

from abc import ABC, abstractmethod
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.signal import hilbert
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin, clone
from sklearn.isotonic import IsotonicRegression
from sklearn.utils.validation import check_is_fitted

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.calibration.location_sets import tooth_and_severity
from sigdb.recognition.rows.streamed import reduced
from sigdb.recognition.rows.tooth_views import averages_by_teeth
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.signature import residual_signal

FALSE_ALARM_RATE = 0.01


class ThresholdLocation(ABC, ClassifierMixin, BaseEstimator):
    """Damage where an indicator exceeds the value that a set share of the healthy training rows exceeds.

    The tooth is the one that the indicator names; of an indicator that names none it is the most frequent one of the
    training rows.

    Parameters
    ----------
    false_alarm_rate
        Share of the healthy training rows that exceed the threshold.
    """

    def __init__(self, false_alarm_rate: float = FALSE_ALARM_RATE) -> None:
        self.false_alarm_rate = false_alarm_rate

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Set the threshold.

        Parameters
        ----------
        X
            Rows with what the indicator is made of.
        y
            First damaged tooth, 0 for none.
        groups
            Not used.
        """
        y = tooth_and_severity(y)[0]
        self.classes_ = np.unique(y)
        healthy = X[y == 0]
        self._learn(healthy)
        self.threshold_ = float(np.quantile(self.indicator(healthy), 1 - self.false_alarm_rate))
        teeth, counts = np.unique(y[y > 0], return_counts=True)
        self.tooth_ = int(teeth[counts.argmax()])
        return self

    def _learn(self, healthy: pd.DataFrame) -> None:
        """Learn what the indicator is relative to."""

    @abstractmethod
    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) indicator, greater for damage."""

    def tooth(self, X: pd.DataFrame) -> IntArray:
        """(rows,) tooth that would be named of each row, were it called damaged."""
        return np.full(len(X), self.tooth_)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) 0 up to the threshold, else the tooth."""
        check_is_fitted(self)
        return np.where(self.indicator(X) > self.threshold_, self.tooth(X), 0)


class MajorityLocation(ClassifierMixin, BaseEstimator):
    """Always the most frequent class of the training rows."""

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Count the classes."""
        self.classes_, counts = np.unique(tooth_and_severity(y)[0], return_counts=True)
        self.answer_ = int(self.classes_[counts.argmax()])
        return self

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) the same answer for every row."""
        return np.full(len(X), self.answer_)


class Fm4Location(ThresholdLocation):
    """Damage where FM4 exceeds the value that one healthy training row in a hundred, or another set share, exceeds.

    FM4 is the same for any tooth, so it cannot tell which: the tooth named is the most frequent one.
    """

    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) FM4."""
        return X["fm4"].to_numpy(float)


class MajoritySeverity(RegressorMixin, BaseEstimator):
    """Always the median of the damaged training rows."""

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Take the medians."""
        self.medians_ = y.loc[y["tooth"] > 0, list(QUANTITIES)].median().to_numpy(float)
        return self

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """The same estimates for every row."""
        return pd.DataFrame([self.medians_] * len(X), columns=QUANTITIES, index=X.index)


class Fm4Severity(RegressorMixin, BaseEstimator):
    """Each target as a monotonic function of FM4 alone."""

    def fit(self, X: pd.DataFrame, y: pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Fit one isotonic regression for each target to the damaged rows."""
        damaged = (y["tooth"] > 0).to_numpy()
        fm4 = X["fm4"].to_numpy(float)[damaged]
        self.regressors_ = [_monotonic(fm4, y[target].to_numpy(float)[damaged]) for target in QUANTITIES]
        return self

    def predict(self, X: pd.DataFrame) -> pd.DataFrame:
        """Estimates for each row."""
        fm4 = X["fm4"].to_numpy(float)
        return pd.DataFrame(
            {name: one.predict(fm4) for name, one in zip(QUANTITIES, self.regressors_, strict=True)}, index=X.index
        )


def _monotonic(fm4: FloatArray, target: FloatArray) -> IsotonicRegression:
    """An isotonic regression, rising or falling as the two vary together."""
    together = float(((fm4 - fm4.mean()) * (target - target.mean())).sum())
    return IsotonicRegression(increasing=together >= 0, out_of_bounds="clip").fit(fm4, target)


class EnvelopePeak:
    """Averages to the crest of the envelope of their residual, and the tooth in whose pass it is."""

    column = "envelope_peak"

    def transform(self, X: pd.DataFrame) -> FloatArray:
        """(rows, 2) of rows with ``teeth`` and ``tsa``: greatest modulus of the analytic residual over its root mean
        square, no unit; tooth, numbered from 1."""
        found = np.empty((len(X), 2))
        for teeth, at, x in averages_by_teeth(X):
            envelope = np.abs(hilbert(residual_signal(x, teeth=teeth)))
            peak = envelope.argmax(axis=1)
            rms = np.sqrt((envelope**2).mean(axis=1)).clip(min=np.finfo(float).tiny)
            found[at] = np.column_stack([envelope.max(axis=1) / rms, 1 + peak * teeth // x.shape[1]])
        return found


class EnvelopeLocation(ThresholdLocation):
    """The tooth whose pass holds the peak of the residual's envelope; none where the peak is no higher than usual.

    The peak is measured in root mean squares of the envelope, and the threshold is what a set share of the healthy
    training rows exceeds. A peak comes at or after the first damaged tooth, so that neighbouring damaged teeth are
    often taken for one another.
    """

    reducer = EnvelopePeak()

    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) peak over root mean square, no unit."""
        return reduced(self.reducer, X)[:, 0]

    def tooth(self, X: pd.DataFrame) -> IntArray:
        """(rows,) tooth in whose pass the peak is."""
        return reduced(self.reducer, X)[:, 1].astype(int)


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


_POINT = ["teeth", "speed_rpm", "torque"]


class ResidualMoments:
    """Averages to the second and the fourth moment of their residual r: ``mean r^2``, ``mean r^4``."""

    column = "residual_moments"

    def transform(self, X: pd.DataFrame) -> FloatArray:
        """(rows, 2) moments of rows with ``teeth`` and ``tsa``, in the signal's unit to the second and the fourth."""
        moments = np.empty((len(X), 2))
        for teeth, at, x in averages_by_teeth(X):
            square = residual_signal(x, teeth=teeth) ** 2
            moments[at] = np.column_stack([square.mean(axis=1), (square**2).mean(axis=1)])
        return moments


class Na4StarLocation(ThresholdLocation):
    """Damage where NA4* exceeds what a set share of the healthy training rows exceeds.

    NA4* is the fourth moment of the residual over the squared mean of the second moment of healthy records
    (:func:`sigdb.signature.na4_star`). A history in time is replaced by the healthy training rows of the same tooth
    count, speed and torque, or of the nearest. It names no tooth: the most frequent one is taken.

    Attributes
    ----------
    points_
        (points, 3) teeth, speed (rpm) and torque (N m) of the healthy training rows.
    baseline_
        (points,) mean second moment of their residuals.
    """

    reducer = ResidualMoments()

    def _learn(self, healthy: pd.DataFrame) -> None:
        second = pd.Series(reduced(self.reducer, healthy)[:, 0], healthy.index)
        mean = second.groupby([healthy[name] for name in _POINT]).mean()
        self.points_, self.baseline_ = mean.index.to_frame().to_numpy(float), mean.to_numpy()

    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) NA4*, no unit."""
        return np.asarray(reduced(self.reducer, X)[:, 1] / self.baseline_[self._place(X)] ** 2)

    def _place(self, X: pd.DataFrame) -> IntArray:
        """(rows,) nearest point by speed and torque, in shares of its own, of the nearest tooth count."""
        points, index = np.unique(X[_POINT].to_numpy(float), axis=0, return_inverse=True)
        away = np.abs(points[:, None] - self.points_) / np.maximum(np.abs(self.points_), np.finfo(float).tiny)
        # Another tooth count is another gear: it comes last, however near speed and torque are.
        distance = np.hypot(away[..., 1], away[..., 2]) + 1e6 * away[..., 0]
        return np.asarray(distance.argmin(axis=1)[index.ravel()])
