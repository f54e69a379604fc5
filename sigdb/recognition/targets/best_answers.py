"""The best possible answers to evaluated rows, in the metrics of a target."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sigdb.core import BoolArray, FloatArray
from sigdb.database import Database
from sigdb.recognition.bound.bayes_bound import Bound, bayes_bound
from sigdb.recognition.bound.bayes_rule import RULES
from sigdb.recognition.bound.operating_points import operating_points
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
    whole, whole_metrics
        Bound without known cells, and metrics of its answers. Its rule does not know which of the cases occur: the
        prior is that of all rows of the database, and severities may lie between those of the templates. None where it
        is the same.
    """

    target: Target
    bound: Bound
    inside: BoolArray
    metrics: Mapping[str, Estimate]
    values: Mapping[str, FloatArray]
    whole: Bound | None = None
    whole_metrics: Mapping[str, Estimate] | None = None

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
    rows, rule = evaluated.rows, target.rule.name
    bound = bayes_bound(database, rows.index, among=rows.index, target=rule, sensor=sensor)
    inside = rows.index.isin(bound.rows.index)
    covered, specimens = rows[inside], evaluated.specimens.select(inside)

    def answered(by: Bound) -> tuple[dict[str, Estimate], dict[str, FloatArray]]:
        values = target.bound_values(by, covered)
        quotients = target.bound_quotients(by, covered, specimens, false_alarm_rate)
        return estimates(target.metrics, values, specimens) | quotients, means(target.metrics, values)

    metrics, values = answered(bound)
    best = BestAnswers(target=target, bound=bound, inside=inside, metrics=metrics, values=values)
    if not _knows_cells(bound, database, sensor):
        return best
    whole = bayes_bound(database, rows.index, target=rule, sensor=sensor, known_cells=False, like=bound.points)
    return replace(best, whole=whole, whole_metrics=answered(whole)[0])


_SAME = 0.05
"""Difference of two priors, summed over all cases, that is put down to chance."""


def _knows_cells(bound: Bound, database: Database, sensor: str) -> bool:
    """Return whether the rule of a bound knows more of the cases than that they are some of the database's."""
    if not bound.points:
        return False
    if RULES[bound.target].continuous and any(point.continuous_severity is not None for point in bound.points):
        return True
    damaged = RULES[bound.target].damaged_only
    every, _ = operating_points(database, bound.rows.index, sensor=sensor, damaged=damaged, like=bound.points)
    return any(
        np.abs(np.exp(point.log_prior) - np.exp(other.log_prior)).sum() > _SAME
        for point, other in zip(bound.points, every, strict=True)
    )
