"""Evaluation of a model on unseen cases, with its baselines and the best possible answer."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, NotApplicableError, Note, SigdbError, plain
from sigdb.database import Database
from sigdb.recognition.answers import Answers
from sigdb.recognition.bound.bayes_bound import Bound, bayes_bound
from sigdb.recognition.criteria import CriterionResult, assess_criteria
from sigdb.recognition.evaluated_rows import has_seen, select_rows
from sigdb.recognition.evaluation_tables import efficiency_table, evaluation_tables
from sigdb.recognition.limitations import limitations
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.metric import estimates, means
from sigdb.recognition.metrics.significance import metrics_above_bound
from sigdb.recognition.model import Model
from sigdb.recognition.settings import CriteriaSettings
from sigdb.recognition.targets.all_targets import target_named
from sigdb.recognition.targets.target import Target

Metrics = Mapping[str, Estimate]
"""Estimates by name of the metric."""


class EvaluationError(SigdbError):
    """A model that is better than is possible: its test rows have leaked, or the law of the rows is wrong."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Metrics of a model and of its baselines on rows whose specimens it has not seen.

    Attributes
    ----------
    target, learner
        As in the model.
    split
        Name of the split, ``S0`` to ``S5``.
    split_text
        How the rows were selected.
    split_hash
        Hash of the table of cases and folds by which the model was trained.
    rows, specimens
        Number of rows and of specimens.
    metrics
        Estimates by estimator and name of the metric.
    differences
        By estimator and metric: the model's minus the estimator's, on the same rows and the same resamples.
    bound
        Metrics of the best possible answer; None where there is none.
    bound_rows
        Number of rows inside the law of the bound; None without a bound.
    above
        Names of the model's metrics that are better than the bound at a significance of 1 %. Empty under S0, where the
        model has seen the specimens and the bound has not.
    tables
        Frames behind the report: metrics against noise and averages, by severity, reliability, curves, cells.
    efficiency
        The model compared with the best possible answer, by noise band:
        :func:`~sigdb.recognition.evaluation_tables.efficiency_table`.
    notes
        Why there is no bound, and known limitations of the model on these rows.
    criteria
        The criteria of the recipe that apply, with the values that they limit.
    """

    target: str
    learner: str
    split: str
    split_text: str
    split_hash: str
    rows: int
    specimens: int
    metrics: Mapping[str, Metrics]
    differences: Mapping[str, Metrics] = field(default_factory=dict)
    bound: Metrics | None = None
    bound_rows: int | None = None
    above: tuple[str, ...] = ()
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    efficiency: pd.DataFrame | None = None
    notes: tuple[Note, ...] = ()
    criteria: tuple[CriterionResult, ...] = ()

    def check(self) -> None:
        """Refuse a model that is better than the bound.

        Raises
        ------
        EvaluationError
            Names the metrics.
        """
        if self.above and self.bound is not None:
            pairs = ", ".join(
                f"{name} {self.metrics[self.learner][name]} against {self.bound[name]}" for name in self.above
            )
            raise EvaluationError(
                f"the model {self.learner!r} is better than the best possible answer ({pairs}): its training has seen "
                "the test rows, or the rows do not follow the law that the bound assumes"
            )

    def as_json(self) -> dict[str, Any]:
        """Return all but the tables as JSON can hold it; None where a value is not known."""
        rows = None if self.efficiency is None else self.efficiency.astype(object).to_dict("records")
        names = [member.name for member in fields(self) if member.name not in ("tables", "efficiency")]
        return {name: plain(getattr(self, name)) for name in names} | {"efficiency": plain(rows)}


@dataclass(frozen=True, kw_only=True, eq=False)
class _Best:
    """The best possible answers to evaluated rows.

    Attributes
    ----------
    bound
        Bound of the rows. Its prior is the share of cases among these rows and no others: with that of all rows of a
        database, a rule that answers for some of the severities only could be better.
    inside
        (rows,) whether a row is inside the law.
    metrics
        Metrics of the answers.
    values
        Value of each row inside the law, by metric.
    """

    bound: Bound
    inside: BoolArray
    metrics: Metrics
    values: Mapping[str, FloatArray]

    @property
    def all_values(self) -> dict[str, FloatArray]:
        """By metric, the value of each row; NaN outside the law."""
        values = {name: np.full(len(self.inside), np.nan) for name in self.values}
        for name, value in values.items():
            value[self.inside] = self.values[name]
        return values


def evaluate(
    model: Model, database: Database, *, bound: bool = True, criteria: CriteriaSettings | None = None
) -> Evaluation:
    """Evaluate a model on the rows of a database that its training has not seen.

    On the database of the training, these are the test cases of the model's split. On other databases they are all rows
    of unseen specimens; specimens are the same gears in databases of the same seed. A database whose rig or solver
    differs is another model form, which is the split S5.

    Parameters
    ----------
    model
        A trained model.
    database
        A finished database with the model's sensor first.
    bound
        Whether to compute the Bayes bound, and the model's efficiency. It takes longer than all else.
    criteria
        Limits to compare the model with; none if left out.

    Returns
    -------
    Evaluation
        Its ``bound`` is None where no row follows the law of the bound, as in trains of several meshes.

    Raises
    ------
    InputError
        If no rows are left, the database holds another sensor, or was extended so that the model's split has changed.
    """
    target = target_named(model.target)
    rows, selection = select_rows(model, database)
    evaluated = _evaluated(model.answers(database, rows), rows)
    values = {name: target.values(each) for name, each in evaluated.items()}
    metrics = {name: _metrics(target, values[name], each) for name, each in evaluated.items()}
    ours = evaluated[model.learner]
    best, notes = _best(model, database, target, ours) if bound else (None, ())
    law, bound_values = (None, {}) if best is None else (best.bound, best.all_values)
    tables = evaluation_tables(target, evaluated, model.learner, law, bound_values)
    efficiency = efficiency_table(target, ours, law)
    above = () if best is None or has_seen(model, database, rows) else _above(target, ours, best)
    return Evaluation(
        target=model.target,
        learner=model.learner,
        split=selection.split,
        split_text=selection.text,
        split_hash=model.split_hash,
        rows=len(rows),
        specimens=rows["specimen"].nunique(),
        metrics=metrics,
        differences=_differences(target, values, model.learner, ours.specimens),
        bound=None if best is None else best.metrics,
        bound_rows=None if best is None else int(best.inside.sum()),
        above=above,
        tables=tables,
        efficiency=efficiency if len(efficiency) else None,
        notes=(*notes, *limitations(model, rows, selection, None if law is None else law.index_error)),
        criteria=assess_criteria(
            criteria or CriteriaSettings(),
            target,
            efficiency,
            _cells(tables, metrics[model.learner]),
            bounded=best is not None,
        ),
    )


def _evaluated(answers: Mapping[str, Answers], rows: pd.DataFrame) -> dict[str, Evaluated]:
    """Return answers with their rows, whose specimens are resampled once."""
    specimens = Specimens(rows["specimen"])
    return {name: Evaluated(rows=rows, answers=each, specimens=specimens) for name, each in answers.items()}


def _metrics(target: Target, values: Mapping[str, FloatArray], evaluated: Evaluated) -> dict[str, Estimate]:
    return estimates(target.metrics, values, evaluated.specimens) | target.quotients(evaluated)


def _best(
    model: Model, database: Database, target: Target, evaluated: Evaluated
) -> tuple[_Best | None, tuple[Note, ...]]:
    """Return the best possible answers, or a note on why there are none."""
    rows = evaluated.rows
    try:
        bound = bayes_bound(database, rows.index, among=rows.index, target=target.rule.name, sensor=model.sensor)
    except NotApplicableError as error:
        return None, (Note(code="no-bound", text=str(error)),)
    inside = rows.index.isin(bound.rows.index)
    known, specimens = rows[inside], evaluated.specimens.select(inside)
    values = target.bound_values(bound, known)
    quotients = target.bound_quotients(bound, known, specimens, model.false_alarm_rate)
    metrics = estimates(target.metrics, values, specimens) | quotients
    return _Best(bound=bound, inside=inside, metrics=metrics, values=means(target.metrics, values)), ()


def _above(target: Target, evaluated: Evaluated, best: _Best) -> tuple[str, ...]:
    """Return the names of the metrics that are better than the bound, on the rows inside its law."""
    inside = evaluated.select(best.inside)
    values = target.values(inside)
    metrics = _metrics(target, values, inside)
    ours = means(target.metrics, values)
    return metrics_above_bound(target.metrics, metrics, best.metrics, ours, best.values, inside.rows)


def _differences(
    target: Target, values: Mapping[str, Mapping[str, FloatArray]], learner: str, specimens: Specimens
) -> dict[str, dict[str, Estimate]]:
    """Return the model minus each other estimator, in the metrics that both have row by row."""
    plain_means = {name: means(target.metrics, each) for name, each in values.items()}
    ours = plain_means.pop(learner)
    return {
        other: {name: specimens.mean(ours[name] - theirs[name]) for name in ours if name in theirs}
        for other, theirs in plain_means.items()
    }


def _cells(tables: Mapping[str, pd.DataFrame], metrics: Metrics) -> pd.DataFrame | None:
    """Return coverage by cell; None where the model gives neither sets nor intervals."""
    gives_sets = any("coverage" in name for name in metrics)
    return tables.get("coverage", pd.DataFrame()) if gives_sets else None
