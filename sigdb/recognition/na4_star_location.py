"""The baseline NA4*: the residual against that of healthy gears at the same operating point."""

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.averages_by_length import averages_by_teeth
from sigdb.recognition.streamed import reduced
from sigdb.recognition.threshold_location import ThresholdLocation
from sigdb.signature import residual_signal

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
