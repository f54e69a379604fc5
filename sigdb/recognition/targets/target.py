"""The contract of a target: a question that models answer, with its labels, metrics, bound and tables."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol

import pandas as pd

from sigdb.core import FloatArray
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.bayes_rule import BayesRule
from sigdb.recognition.bound.efficiency import Columns
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.metric import Metric
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank


@dataclass(frozen=True, kw_only=True)
class TargetText:
    """Sentences on a target for cards and pages.

    Attributes
    ----------
    purpose
        Use of a model of the target.
    baselines
        Baselines of the target; ``{rate}`` is the false-alarm rate of their thresholds.
    failures
        Failures that are to be expected.
    efficiency
        Columns of the table of efficiency.
    """

    purpose: str
    baselines: str
    failures: str
    efficiency: str


class Target(Protocol):
    """A question that models answer.

    Attributes
    ----------
    name
        Name in recipes, models and results.
    metrics
        All metrics, in the order of tables.
    noise_metrics
        Names of those that are shown against noise.
    pictured_metrics
        Names of those that are drawn against noise.
    headline
        Name of the metric that sums a model up.
    paired_metric
        Name of the metric in which a model is compared with its baselines.
    criteria
        Names of the criteria that apply, in order.
    rule
        The Bayes rule of the target.
    row_condition
        SQL condition on the rows that serve; empty for all.
    columns
        Columns of the rows that labels are made of besides tooth and severities.
    varying
        Labels of which at least one must vary over the damaged rows to learn from.
    damaged_only
        Whether models are evaluated on damaged rows only.
    text
        Sentences for cards and pages.
    """

    name: str
    metrics: tuple[Metric, ...]
    noise_metrics: tuple[str, ...]
    pictured_metrics: tuple[str, ...]
    headline: str
    paired_metric: str
    criteria: tuple[str, ...]
    rule: BayesRule
    row_condition: str
    columns: tuple[str, ...]
    varying: tuple[str, ...]
    damaged_only: bool
    text: TargetText

    def labels(self, rows: pd.DataFrame) -> "pd.Series[int] | pd.DataFrame":
        """Return what estimators learn from rows."""
        ...

    def estimators(self, settings: RecognitionSettings, bank: TemplateBank | None) -> dict[str, Estimator]:
        """Return the unfitted estimators by name: the learners, then the baselines."""
        ...

    def values(self, evaluated: Evaluated) -> dict[str, FloatArray]:
        """Return the value of each row by metric, for metrics of which rows have one."""
        ...

    def quotients(self, evaluated: Evaluated) -> dict[str, Estimate]:
        """Return the metrics that are no means of rows."""
        ...

    def bound_values(self, bound: Bound, rows: pd.DataFrame) -> dict[str, FloatArray]:
        """Return the value of each row by metric for the answers of the Bayes rule.

        Parameters
        ----------
        bound
            Bound of the rows.
        rows
            The rows inside the law, in the order of ``bound.rows``.
        """
        ...

    def bound_quotients(
        self, bound: Bound, rows: pd.DataFrame, specimens: Specimens, false_alarm_rate: float
    ) -> dict[str, Estimate]:
        """Return the metrics of the Bayes rule that are no means of such values.

        Parameters
        ----------
        bound, rows
            As in :meth:`bound_values`.
        specimens
            Specimens of the rows.
        false_alarm_rate
            Rate at which a detector is set.
        """
        ...

    def tables(self, evaluated: Mapping[str, Evaluated], learner: str, bound: Bound | None) -> dict[str, pd.DataFrame]:
        """Return the frames behind the pictures of an evaluation, by name.

        Parameters
        ----------
        evaluated
            Evaluated rows by estimator.
        learner
            Name of the estimator that is the model.
        bound
            Bound of the rows; None without one.
        """
        ...

    def efficiency(self, evaluated: Evaluated, bound: Bound | None) -> list[Columns]:
        """Return the rows of the table of efficiency for one band of noise."""
        ...


def metric_among(target: Target, name: str, metrics: Collection[str]) -> str:
    """Return the name of a metric, or of the first pictured one in its place where the model has no such metric.

    A model of cracks has no error of a stiffness loss.

    Parameters
    ----------
    target
        Target of the model.
    name
        Such as the target's headline.
    metrics
        Names of the model's metrics.
    """
    return next((each for each in (name, *target.pictured_metrics) if each in metrics), name)
