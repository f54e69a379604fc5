"""The baseline of the nearest template: least Euclidean distance over templates and turns."""

from typing import Self

import numpy as np
from sklearn.base import BaseEstimator

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.estimators.baselines.threshold import FALSE_ALARM_RATE, ThresholdLocation
from sigdb.recognition.estimators.contract import required_bank
from sigdb.recognition.rows.batch import POINT, TSA, Batch, Rows
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.local_templates import LocalTemplates


class NearestTemplate(BaseEstimator):
    """Reducer of averages to the nearest damaged template, over all teeth, at the row's operating point.

    Parameters
    ----------
    bank
        Templates. Only their clean averages count.
    """

    column = "nearest_template"

    def __init__(self, bank: TemplateBank) -> None:
        self.bank = bank

    def transform(self, X: Batch) -> FloatArray:
        """Return two numbers of each row, (rows, 2).

        The first is the distance to the nearest healthy template less that to the nearest damaged one, over the norm of
        the average. The second is the tooth to which the damaged one is turned, numbered from 1.

        Raises
        ------
        NotApplicableError
            If the bank does not have a tooth count.
        """
        nearest = np.empty((len(X), 2))
        averages: dict[int, tuple[IntArray, FloatArray]] = {}
        for local, at, coefficients in self.bank.locals(*X.operating_point()):
            averages = averages or {teeth: (of_teeth, x) for teeth, of_teeth, x in X.averages()}
            of_teeth, x = averages[local.teeth]
            nearest[at] = _nearest(local, x[np.searchsorted(of_teeth, at)], coefficients)
        return nearest


def _nearest(local: LocalTemplates, x: FloatArray, coefficients: FloatArray | None) -> FloatArray:
    """Return ``(min |x - s_none| - min |x - s_damage turned|) / |x|``, and the tooth; (rows, 2)."""
    distance = np.sqrt(local.laws.squared_distance(x, coefficients).clip(min=0))
    none = distance[:, local.healthy].min(axis=(1, 2))
    damage = distance[:, ~local.healthy].min(axis=1)
    norm = np.linalg.norm(x, axis=1).clip(min=np.finfo(float).tiny)
    return np.column_stack([(none - damage.min(axis=1)) / norm, 1 + damage.argmin(axis=1)])


class NearestTemplateLocation(ThresholdLocation):
    """The tooth of the nearest template; none where it is no nearer than the nearest healthy one by more than usual.

    Parameters
    ----------
    bank
        Templates.
    false_alarm_rate
        Share of the healthy training rows for which damaged templates are nearer by more than the threshold.
    """

    reads = frozenset({*POINT, TSA})
    needs_bank = True

    def __init__(self, bank: TemplateBank, false_alarm_rate: float = FALSE_ALARM_RATE) -> None:
        super().__init__(false_alarm_rate)
        self.bank = bank

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted baseline at the false-alarm rate of the settings."""
        return cls(required_bank(bank), settings.false_alarm_rate)

    @property
    def template_bank(self) -> TemplateBank:
        """Bank of templates that it carries."""
        return self.bank

    @property
    def reducer(self) -> NearestTemplate:
        """Reducer of averages to distances from the templates."""
        return NearestTemplate(self.bank)

    def indicator(self, X: Rows) -> FloatArray:
        """Return how much nearer, over the norm of the average, (rows,)."""
        return self._batch(X).reduce(self.reducer)[:, 0]

    def tooth(self, X: Rows) -> IntArray:
        """Return the tooth of the nearest template, (rows,)."""
        return self._batch(X).reduce(self.reducer)[:, 1].astype(int)
