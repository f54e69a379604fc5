"""The best possible answers to evaluated rows, in the metrics of a target."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sigdb.core import BoolArray, FloatArray
from sigdb.database import Database
from sigdb.recognition.bound.bayes_bound import Bound, bayes_bound
from sigdb.recognition.metrics.estimate import Estimate
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.metric import estimates, means
from sigdb.recognition.metrics.significance import metrics_above_bound
from sigdb.recognition.targets.target import Target


@dataclass(frozen=True, kw_only=True, eq=False)
class BestAnswers:
    """The answers of the Bayes rule to evaluated rows.

    Attributes
    ----------
    target
        Target of the answers.
    bound
        Bound of the rows. Its prior is the share of cases among these rows and no others: with that of all rows of a
        database, a rule that answers for some of the severities only could be better.
    inside
        (rows,) whether a row is inside the law.
    metrics
        Metrics of the answers.
    values
        Value of each row inside the law by metric, for metrics that are plain means.
    """

    target: Target
    bound: Bound
    inside: BoolArray
    metrics: Mapping[str, Estimate]
    values: Mapping[str, FloatArray]

    @property
    def all_values(self) -> dict[str, FloatArray]:
        """By metric, the value of each row; NaN outside the law."""
        values = {name: np.full(len(self.inside), np.nan) for name in self.values}
        for name, value in values.items():
            value[self.inside] = self.values[name]
        return values

    def above(self, evaluated: Evaluated) -> tuple[str, ...]:
        """Return the names of the metrics in which a model is better, on the rows inside the law.

        Parameters
        ----------
        evaluated
            The rows with the model's answers.
        """
        target, model = self.target, evaluated.select(self.inside)
        values = target.values(model)
        metrics = estimates(target.metrics, values, model.specimens) | target.quotients(model)
        return metrics_above_bound(
            target.metrics, metrics, self.metrics, means(target.metrics, values), self.values, model.rows
        )


def best_answers(
    target: Target, database: Database, evaluated: Evaluated, *, sensor: str, false_alarm_rate: float
) -> BestAnswers:
    """Compute the best possible answers.

    Parameters
    ----------
    target
        Target of the answers.
    database
        Database of the rows.
    evaluated
        The rows.
    sensor
        Sensor whose averages the model reads.
    false_alarm_rate
        Rate at which a detector is set.

    Raises
    ------
    NotApplicableError
        If no row follows the law of the bound.
    """
    rows = evaluated.rows
    bound = bayes_bound(database, rows.index, among=rows.index, target=target.rule.name, sensor=sensor)
    inside = rows.index.isin(bound.rows.index)
    covered, specimens = rows[inside], evaluated.specimens.select(inside)
    values = target.bound_values(bound, covered)
    metrics = estimates(target.metrics, values, specimens) | target.bound_quotients(
        bound, covered, specimens, false_alarm_rate
    )
    return BestAnswers(target=target, bound=bound, inside=inside, metrics=metrics, values=means(target.metrics, values))
