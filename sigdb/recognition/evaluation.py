"""Evaluation of a model on unseen cases, with its baselines and the best possible answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import pandas as pd

from sigdb.core import NotApplicableError, Note, OnStep, SigdbError, ignore, plain
from sigdb.database import Database, default_split
from sigdb.recognition.criteria import CriterionResult, assess_criteria
from sigdb.recognition.decision import with_prevalence
from sigdb.recognition.estimators.registry import DETECTION
from sigdb.recognition.estimators.user_estimator import user_estimator
from sigdb.recognition.evaluated_rows import select_rows
from sigdb.recognition.evaluation_tables import efficiency_table, evaluation_tables
from sigdb.recognition.idle_cores import idle_cores
from sigdb.recognition.limitations import limitations
from sigdb.recognition.metrics.estimate import Estimate
from sigdb.recognition.metrics.evaluated import Evaluated
from sigdb.recognition.metrics.metric import differences, estimates
from sigdb.recognition.model import Model
from sigdb.recognition.rows.streams import sensor_in
from sigdb.recognition.settings import CriteriaSettings, RecognitionSettings
from sigdb.recognition.splits.across import across_notes
from sigdb.recognition.splits.confounds import measured_notes
from sigdb.recognition.splits.healthy_only import HEALTHY_ONLY, healthy_only_answers, healthy_only_notes
from sigdb.recognition.targets.all_targets import target_named
from sigdb.recognition.targets.best_answers import best_answers
from sigdb.recognition.training import train

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
        Metrics of the best possible answer with known cells, whose rule knows which cases occur; None where there
        is none.
    bound_whole_grid
        Metrics of the best possible answer to a rule that knows no more than the database: any of its cases, and
        severities between them. None where it is the same.
    bound_rows
        Number of rows inside the law of the bound; None without a bound.
    above
        Names of the model's metrics that are better than the bound at a significance of 1 %. Empty under S0, where the
        model has seen the specimens and the bound has not.
    tables
        Frames behind the report: metrics against noise and averages, by severity, reliability, curves, cells.
    efficiency
        The model compared with the best possible answer, by noise band, that with the whole grid where it differs:
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
    bound_whole_grid: Metrics | None = None
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


@idle_cores()
def evaluate(
    model: Model | Any,
    database: Database,
    *,
    bound: bool = True,
    criteria: CriteriaSettings | None = None,
    target: str = "location",
    split: str = "",
    columns: Sequence[str] = (),
    drawn_rows: bool = False,
    baselines: bool = True,
    where: str | None = None,
    settings: RecognitionSettings | None = None,
    on_step: OnStep = ignore,
) -> Evaluation:
    """Evaluate a model on the rows of a database that its training has not seen.

    An estimator of one's own, with the conventions of scikit-learn, is first trained on the training rows of a split of
    the database, and the baselines with it. It reads the columns of :meth:`sigdb.database.Database.xy`.

    On the database of the training, these are the test cases of the model's split. On other databases they are all rows
    of unseen specimens; specimens are the same gears in databases of the same seed. A database whose rig or solver
    differs is another model form, which is the split S5. Models of location answer with the share of damaged rows among
    these as the prevalence, which the best possible answer knows too.

    Parameters
    ----------
    model
        A trained model. Or anything with ``fit(X, y)`` and ``predict(X)``, for probabilities with ``predict_proba(X)``
        and ``classes_``: a copy of it is trained.
    database
        A finished database with the model's sensor first.
    bound
        Whether to compute the Bayes bound, and the model's efficiency. It takes longer than all else.
    criteria
        Limits to compare the model with; none if left out.
    target, split, columns
        Question, split (S1 if left out, of recordings ``recording``) and input columns of an estimator of one's own;
        see :meth:`sigdb.database.Database.xy`.
    drawn_rows
        Whether an estimator of one's own is trained on the rows that are drawn for the baselines
        (:data:`~sigdb.recognition.training.DRAWN_ROWS`), in place of all.
    baselines
        Whether the learners and baselines of sigdb are trained and evaluated too, where an estimator of one's own is.
    where
        A condition on the rows to evaluate on, in SQL.
    settings
        Folds, and settings of the baselines, where an estimator of one's own is trained.
    on_step
        Called with the name of each estimator before it is trained, an estimator of one's own and baselines.

    Returns
    -------
    Evaluation
        Its ``bound`` is None where no row follows the law of the bound.

    Raises
    ------
    InputError
        If no rows are left, the database holds another sensor, unit or tooth count, or was extended so that the model's
        split has changed.
    """
    if not isinstance(model, Model):
        name = target_named(target).name
        estimator = user_estimator(model, name, database, columns, drawn_rows=drawn_rows)
        model = train(
            database,
            target,
            settings,
            split=split or default_split(database),
            user_estimator=estimator,
            baselines=baselines,
            on_step=on_step,
        )
    question = target_named(model.target)
    rows, selection = select_rows(model, database, where)
    measured, prevalence = database.manifest.is_measured, float((rows["tooth"] > 0).mean())
    answers = model.answers(database, rows)
    for name in answers:  # in place, so that memory holds those of one estimator twice at most
        answers[name] = with_prevalence(answers[name], model.estimators[name].trained_prevalence, prevalence)
    floor = healthy_only_answers(database, rows, model.false_alarm_rate) if measured else None
    if floor is not None and question.name == DETECTION:
        answers[HEALTHY_ONLY] = floor
    evaluated = Evaluated.of_each(answers, rows)
    values = {name: question.values(each) for name, each in evaluated.items()}
    metrics = {
        name: estimates(question.metrics, values[name], each.specimens) | question.quotients(each)
        for name, each in evaluated.items()
    }
    ours, notes, best = evaluated[model.learner], [], None
    try:
        if bound and measured:
            raise NotApplicableError(f"{database.store}: the law of measured rows is not known")
        if bound:
            rate = model.false_alarm_rate
            best = best_answers(
                question, database, ours, sensor=sensor_in(database, model.sensor), false_alarm_rate=rate
            )
    except NotApplicableError as error:
        notes.append(Note(code="no-bound", text=str(error)))
    law, bound_values = (None, {}) if best is None else (best.bound, best.all_values)
    tables = evaluation_tables(question, evaluated, model.learner, law, bound_values)
    efficiency = efficiency_table(question, ours, law if best is None or best.whole is None else best.whole)
    index_error = None if law is None else law.index_error
    return Evaluation(
        target=model.target,
        learner=model.learner,
        split=selection.split,
        split_text=selection.text,
        split_hash=model.split_hash,
        rows=len(rows),
        specimens=rows["specimen"].nunique(),
        metrics=metrics,
        differences=differences(question.metrics, values, model.learner, ours.specimens),
        bound=None if best is None else best.metrics,
        bound_whole_grid=None if best is None else best.whole_metrics,
        bound_rows=None if best is None else int(best.inside.sum()),
        above=() if best is None or selection.seen else best.above(ours),
        tables=tables,
        efficiency=efficiency if len(efficiency) else None,
        notes=(
            *notes,
            *limitations(model, rows, selection, index_error),
            *(across_notes(model, database, rows) if selection.across else ()),
            *(measured_notes(database, rows) if measured else ()),
            *(() if floor is None or HEALTHY_ONLY in answers else healthy_only_notes(floor, rows)),
        ),
        criteria=assess_criteria(
            criteria or CriteriaSettings(),
            question,
            metrics[model.learner],
            efficiency,
            tables,
            bounded=best is not None,
        ),
    )
