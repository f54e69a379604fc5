"""The baseline of the nearest template: least Euclidean distance over templates and turns."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import softmax
from sklearn.base import BaseEstimator, ClassifierMixin

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.calibration.probabilities import with_none
from sigdb.recognition.estimators.baselines.threshold import FALSE_ALARM_RATE, ThresholdLocation
from sigdb.recognition.rows.streamed import reduced
from sigdb.recognition.rows.tooth_views import averages_by_teeth
from sigdb.recognition.templates.bank import PointTemplates, TemplateBank
from sigdb.recognition.templates.hypotheses import TurnedProducts
from sigdb.recognition.templates.scores import TemplateScores


class NearestTemplate(BaseEstimator):
    """Averages to the nearest damaged template, of all turned to each tooth, at the nearest operating point.

    Parameters
    ----------
    bank
        Templates, of which only the clean averages count.
    """

    column = "nearest_template"

    def __init__(self, bank: TemplateBank) -> None:
        self.bank = bank

    def transform(self, X: pd.DataFrame) -> FloatArray:
        """(rows, 2) by how much the nearest damaged template is nearer than the nearest healthy one, over the norm of
        the average; tooth to which it is turned, numbered from 1.

        Raises
        ------
        InputError
            If the bank does not have a tooth count.
        """
        found = np.empty((len(X), 2))
        for teeth, at, x in averages_by_teeth(X):
            some = X.iloc[at]
            place = self.bank.nearest(*(some[name].to_numpy(float) for name in ("speed_rpm", "torque", "teeth")))
            for one in np.unique(place):
                found[at[place == one]] = _nearest(self.bank.points[one], x[place == one], teeth)
        return found


def _nearest(point: PointTemplates, x: FloatArray, teeth: int) -> FloatArray:
    """(rows, 2) ``(min |x - s_none| - min |x - s_damage turned|) / |x|``, and the tooth."""
    s, square = point.hypotheses.signal, (x**2).sum(axis=1)
    distance = square[:, None] - 2 * TurnedProducts(s, teeth)(x) + (s**2).sum(axis=1)  # teeth, rows, templates
    distance = np.sqrt(distance.clip(min=0))
    none = distance[:, :, point.healthy].min(axis=(0, 2))
    damage = distance[:, :, ~point.healthy].min(axis=2)
    norm = np.sqrt(square).clip(min=np.finfo(float).tiny)
    return np.column_stack([(none - damage.min(axis=0)) / norm, 1 + damage.argmin(axis=0)])


class NearestTemplateLocation(ThresholdLocation):
    """The tooth of the nearest template; none where it is no nearer than the nearest healthy one by more than usual.

    Parameters
    ----------
    bank
        Templates.
    false_alarm_rate
        Share of the healthy training rows for which damaged templates are nearer by more than the threshold.
    """

    def __init__(self, bank: TemplateBank, false_alarm_rate: float = FALSE_ALARM_RATE) -> None:
        super().__init__(false_alarm_rate)
        self.bank = bank

    @property
    def reducer(self) -> NearestTemplate:
        """What it reads of averages."""
        return NearestTemplate(self.bank)

    def indicator(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) how much nearer, over the norm of the average."""
        return reduced(self.reducer, X)[:, 0]

    def tooth(self, X: pd.DataFrame) -> IntArray:
        """(rows,) tooth of the nearest template."""
        return reduced(self.reducer, X)[:, 1].astype(int)


class WhitenedBankLocation(ClassifierMixin, BaseEstimator):
    """The tooth of the greatest log-likelihood ratio of :class:`TemplateScores`, none where all are below 0.

    Nothing is learnt from rows: :class:`TemplateLocation` without its calibration.

    Parameters
    ----------
    bank
        Templates.
    n_jobs
        Threads of the scores.
    """

    def __init__(self, bank: TemplateBank, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.n_jobs = n_jobs

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Learn nothing."""
        self.classes_ = np.arange(max(self.bank.teeth) + 1)
        return self

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) 0 for none, and the log-likelihood ratio of each tooth."""
        ratio = reduced(TemplateScores(self.bank, self.n_jobs), X)[:, : max(self.bank.teeth)]
        return with_none(ratio, 1.0, 0.0)

    def predict_proba(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) probability of 'none' and of each tooth, if both kinds are as likely beforehand."""
        return softmax(self.decision_function(X), axis=1)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) first damaged tooth, 0 for none."""
        return self.decision_function(X).argmax(axis=1)
