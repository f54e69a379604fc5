"""Evaluating a model: figures of merit of it, of what it must beat and of what cannot be beaten, on unseen cases."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray, InputError, SigdbError
from sigdb.database import Database
from sigdb.recognition.answers import Answers
from sigdb.recognition.bound.bayes_bound import Bound, bayes_bound, detection_bound
from sigdb.recognition.bound.efficiency import against_bound, posterior_answers
from sigdb.recognition.bound.operating_points import OperatingPoint, operating_points
from sigdb.recognition.criteria import aims, causes
from sigdb.recognition.evaluated_rows import has_seen, requested, requested_rows
from sigdb.recognition.evaluation_tables import evaluation_tables, records
from sigdb.recognition.metrics.calibration import calibration_figures, calibration_values
from sigdb.recognition.metrics.coverage import set_figures, set_values
from sigdb.recognition.metrics.detection import detection_figures, roc
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.metrics.location_and_severity import FIGURES, VALUES, severity_values
from sigdb.recognition.metrics.probability_of_detection import pod_figures
from sigdb.recognition.metrics.significance import figures_above_bound
from sigdb.recognition.rows.streamed import feature_batches
from sigdb.recognition.training import Model


class EvaluationError(SigdbError):
    """A model that is better than is possible: what it is asked about has leaked, or the law of the rows is wrong."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Figures of merit of a model and of its baselines on rows whose specimens it has not seen.

    Attributes
    ----------
    target, learner
        As in the model.
    split
        How the rows were chosen, in words.
    split_hash
        Hash of the table of cases and folds that the model was trained by.
    rows, specimens
        Number of rows and of specimens.
    figures
        Figures by estimator and name.
    differences
        By estimator and name: the model's figure minus the estimator's, of the same rows and the same resamples.
    bound
        Figures of the best possible answer, None where it was not computed.
    bound_rows
        Number of rows that they are of: rows outside of the law are not among them.
    above
        Names of the model's figures that are better than the bound at a significance of 1 %; none under S0, where the
        model has seen the specimens, and the bound has not.
    tables
        Frames for the report: figures against noise and averages, by severity, reliability, curves, cells.
    efficiency
        The model beside the best possible answer, by noise band: see :func:`~sigdb.recognition.bound.efficiency`. None
        where it was not asked for.
    aims
        What the model should reach, and whether it does: see :func:`~sigdb.recognition.criteria.aims`.
    """

    target: str
    learner: str
    split: str
    split_hash: str
    rows: int
    specimens: int
    figures: dict[str, dict[str, Estimate]]
    differences: dict[str, dict[str, Estimate]] = field(default_factory=dict)
    bound: Mapping[str, Estimate] | None = None
    bound_rows: int | None = None
    above: tuple[str, ...] = ()
    tables: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    efficiency: pd.DataFrame | None = None
    aims: pd.DataFrame | None = None

    def check(self) -> None:
        """Refuse a model that is better than the bound.

        Raises
        ------
        EvaluationError
            Names the figures.
        """
        if self.above and self.bound is not None:
            said = ", ".join(
                f"{name} {self.figures[self.learner][name]} against {self.bound[name]}" for name in self.above
            )
            raise EvaluationError(
                f"the model {self.learner!r} is better than the best possible answer ({said}): its training has seen "
                "what it was asked about, or the rows do not follow the law that the bound assumes"
            )

    def as_json(self) -> dict[str, Any]:
        """All but the tables as numbers, text, lists and dictionaries; None where a figure is not known."""
        return {
            **{name: getattr(self, name) for name in ("target", "learner", "split", "split_hash", "rows", "specimens")},
            "figures": {name: _plain(figures) for name, figures in self.figures.items()},
            "differences": {name: _plain(figures) for name, figures in self.differences.items()},
            "bound": None if self.bound is None else _plain(self.bound),
            "bound_rows": self.bound_rows,
            "above": list(self.above),
            "efficiency": records(self.efficiency),
            "aims": records(self.aims),
        }


def evaluate(
    model: Model,
    database: Database,
    *,
    bound: Mapping[str, Estimate] | None = None,
    bound_values: Mapping[str, pd.Series] | None = None,
    bound_rows: ArrayLike | None = None,
    beside: Callable[[Evaluation, Answers, pd.DataFrame], Evaluation] = lambda evaluation, answers, rows: evaluation,
) -> Evaluation:
    """Evaluate a model on the rows of a database that its split keeps for that.

    On the database that it was trained on, these are the test cases of its split. On others they are all rows whose
    specimens it has not seen; specimens are the same gears in databases of the same seed. A database whose rig or
    solver differs is another model form, which is the split S5.

    Parameters
    ----------
    model
        A trained model.
    database
        A finished database with the model's sensor first.
    bound
        Figures of the best possible answer to the same rows (:func:`requested_rows`), by name.
    bound_values
        By id of these rows, what a bound's figure is the mean of: with it the model is compared row by row.
    bound_rows
        Ids of the rows that the bound is of; all if left out. Only on these the model is held against it.
    beside
        Completes the evaluation from the model's answers and the rows.

    Raises
    ------
    InputError
        If no rows are left, the database holds another sensor, or was extended so that the model's split has changed.
    """
    rows, tells = requested(model, database)
    answers = _answers(model, database, rows)
    figures = {name: answer_figures(answer, rows, model.target) for name, answer in answers.items()}
    values = {name: answer_values(answer, rows, model.target) for name, answer in answers.items()}
    best = {name: one.reindex(rows.index).to_numpy(float) for name, one in (bound_values or {}).items()}
    inside = np.full(len(rows), True) if bound_rows is None else rows.index.isin(np.asarray(bound_rows))
    evaluation = Evaluation(
        target=model.target,
        learner=model.learner,
        split=tells,
        split_hash=model.split_hash,
        rows=len(rows),
        specimens=rows["specimen"].nunique(),
        figures=figures,
        differences=_differences(values, model.learner, rows),
        bound=bound,
        bound_rows=None if bound is None else int(inside.sum()),
        above=()
        if bound is None or has_seen(model, database, rows)
        else _above(answers[model.learner], rows, model.target, bound, best, inside),
        tables=evaluation_tables(answers, rows, model.learner, best),
    )
    return beside(evaluation, answers[model.learner], rows)


def answer_figures(answers: Answers, rows: pd.DataFrame, target: str) -> dict[str, Estimate]:
    """All figures that answers allow."""
    figures = FIGURES[target](answers.predicted, rows)
    if answers.detection is not None:
        figures |= detection_figures(answers.detection, rows) | pod_figures(answers.detection, rows)
    if answers.probabilities is not None:
        figures |= calibration_figures(answers.probabilities, rows)
    if answers.sets is not None:
        figures |= set_figures(answers.sets, rows)
    return figures


def answer_values(answers: Answers, rows: pd.DataFrame, target: str) -> dict[str, FloatArray]:
    """Of each row, what those figures that are means are means of."""
    values = {name: one for name, one in VALUES[target](answers.predicted, rows).items() if not name.startswith("rmse")}
    if answers.probabilities is not None:
        values |= calibration_values(answers.probabilities, rows)
    if answers.sets is not None:
        values |= set_values(answers.sets, rows)
    return values


def _above(
    answers: Answers,
    rows: pd.DataFrame,
    target: str,
    bound: Mapping[str, Estimate],
    bound_values: Mapping[str, FloatArray],
    inside: BoolArray,
) -> tuple[str, ...]:
    """Names of the figures that are better than the bound, on the rows that it holds."""
    ours, some = answers.select(inside), rows[inside]
    best = {name: one[inside] for name, one in bound_values.items()}
    figures, values = answer_figures(ours, some, target), answer_values(ours, some, target)
    return figures_above_bound(figures, bound, values, best, some)


def _differences(
    values: Mapping[str, Mapping[str, FloatArray]], learner: str, rows: pd.DataFrame
) -> dict[str, dict[str, Estimate]]:
    """The model minus each other estimator, of the figures that both have."""
    specimens, ours = Specimens(rows["specimen"]), values[learner]
    return {
        other: {name: specimens.mean(ours[name] - theirs[name]) for name in ours if name in theirs}
        for other, theirs in values.items()
        if other != learner
    }


def _answers(model: Model, database: Database, rows: pd.DataFrame) -> dict[str, Answers]:
    """Answers of the model, and of those beside it that can answer these rows, batch by batch."""
    rows = model.ready(database, rows)
    found: dict[str, list[Answers]] = {name: [] for name in model.estimators}
    for _, batch in feature_batches(database, rows):
        for name in list(found):
            try:
                found[name].append(Answers.of(model.estimators[name], batch))
            except InputError:
                if name == model.learner:
                    raise
                del found[name]
    return {name: Answers.concatenate(parts) for name, parts in found.items()}


def _plain(figures: Mapping[str, Estimate]) -> dict[str, dict[str, float | None]]:
    return {
        name: {end: None if np.isnan(value := getattr(one, end)) else value for end in ("value", "low", "high")}
        for name, one in figures.items()
    }


def evaluate_with_bound(model: Model, database: Database) -> Evaluation:
    """Evaluate a model with the Bayes bound beside it, where the law of the rows allows to compute one.

    Parameters
    ----------
    model
        A trained model.
    database
        A finished database with the model's sensor first.

    Returns
    -------
    Evaluation
        As of :func:`evaluate`, with ``efficiency`` and ``aims``; its ``bound`` is None where no row follows the law
        that the bound knows, as in trains of several meshes.

    Raises
    ------
    InputError
        As :func:`evaluate`.
    """
    rows = requested_rows(model, database)
    try:
        best = _Best.of(model, database, rows)
    except InputError:
        return evaluate(model, database, beside=lambda *given: _judged(model, *given, best=None))
    return evaluate(
        model,
        database,
        bound=best.figures,
        bound_values=best.values,
        bound_rows=best.rows.index,
        beside=lambda *given: _judged(model, *given, best=best),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Best:
    """The bound of the rows that a model is asked about, and the points of its law.

    Its prior is the share of cases among these rows and no others: with that of all rows of a database a rule that is
    asked about some of the severities only could be bettered.

    Attributes
    ----------
    bound
        The bound; of location for a detector too.
    rows
        Those of the rows that it holds, as the model is asked about them.
    points
        Their operating points.
    false_alarm_rate
        Rate of a detector; None for other models.
    """

    bound: Bound
    rows: pd.DataFrame
    points: Sequence[OperatingPoint]
    false_alarm_rate: float | None

    @classmethod
    def of(cls, model: Model, database: Database, rows: pd.DataFrame) -> "_Best":
        severity = model.target == "severity"
        target = "severity" if severity else "location"
        best = bayes_bound(database, rows.index, among=rows.index, target=target, sensor=model.sensor)
        ids = best.rows.index
        points, _ = operating_points(database, ids, among=ids, sensor=model.sensor, damaged=severity)
        rate = model.false_alarm_rate if model.target == "detection" else None
        inside = rows.loc[rows.index.isin(best.rows.index)]
        return cls(bound=best, rows=inside, points=points, false_alarm_rate=rate)

    @cached_property
    def values(self) -> dict[str, pd.Series]:
        """By figure and id, what figures are means of; the CRPS by the quantiles that models give."""
        if self.false_alarm_rate is not None:
            return {}
        own = self.bound.rows.loc[self.rows.index]
        values = {str(name): self.bound.values[name] for name in self.bound.values if not str(name).startswith("rmse")}
        if self.bound.target == "severity":
            scored = severity_values(posterior_answers(own), self.rows)
            values |= {name: pd.Series(value, own.index) for name, value in scored.items() if name.startswith("crps")}
        return values

    @cached_property
    def figures(self) -> dict[str, Estimate]:
        """The bound's figures, those of detection too."""
        if self.false_alarm_rate is not None:
            return detection_bound(self.bound.rows.loc[self.rows.index, "log_odds"], self.rows, self.false_alarm_rate)
        specimens, ids = Specimens(self.bound.rows["specimen"]), self.bound.rows.index
        figures = {name: specimens.mean(one.loc[ids].to_numpy()) for name, one in self.values.items()}
        if self.bound.target == "severity":
            figures |= {name: one for name, one in self.bound.figures.items() if name.startswith("rmse")}
        elif "stiffness_loss" in self.rows:
            score: FloatArray = self.bound.rows.loc[self.rows.index, "log_odds"].to_numpy()
            figures |= detection_figures(score, self.rows) | pod_figures(score, self.rows)
        return figures

    def curves(self, tables: Mapping[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        """The table ``roc`` of an evaluation, where it has one, with the bound's curve."""
        if "roc" not in tables:
            return {}
        own = roc(self.bound.rows.loc[self.rows.index, "log_odds"].to_numpy(), self.rows)
        return {"roc": pd.concat([tables["roc"], own.assign(estimator="bound")], ignore_index=True)}

    @cached_property
    def index_error(self) -> float:
        """Root mean square of the sizes of the index errors, m."""
        return float(np.sqrt(np.concatenate([point.asked.rows["index_error"] ** 2 for point in self.points]).mean()))


def _judged(
    model: Model, evaluation: Evaluation, answers: Answers, rows: pd.DataFrame, *, best: _Best | None
) -> Evaluation:
    """An evaluation with the model's efficiency and its aims."""
    law = (None, ()) if best is None else (best.bound, best.points)
    table = against_bound(model.target, answers, rows, *law)
    cells = evaluation.tables.get("coverage")
    if cells is None and _gives_sets(answers):
        cells = pd.DataFrame()
    why = causes(model, rows, evaluation.split, None if best is None else best.index_error)
    return replace(
        evaluation,
        tables={**evaluation.tables, **({} if best is None else best.curves(evaluation.tables))},
        efficiency=table if len(table) else None,
        aims=aims(model.target, table, cells, why, bounded=best is not None),
    )


def _gives_sets(answers: Answers) -> bool:
    """Whether a model gives sets of answers, or intervals."""
    if isinstance(answers.predicted, pd.DataFrame):
        return any(str(name).endswith("_low") for name in answers.predicted)
    return answers.sets is not None
