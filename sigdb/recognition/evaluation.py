"""Evaluating a model: figures of merit of it, of what it must beat and of what cannot be beaten, on unseen cases."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core.errors import InputError, SigdbError
from sigdb.core.typing import BoolArray, FloatArray
from sigdb.database import Database
from sigdb.recognition.answers import Answers
from sigdb.recognition.bootstrap import Figure, Specimens
from sigdb.recognition.evaluation_tables import evaluation_tables, records
from sigdb.recognition.figures_above_bound import figures_above_bound
from sigdb.recognition.metrics import FIGURES, VALUES
from sigdb.recognition.metrics_calibration import calibration_figures, calibration_values
from sigdb.recognition.metrics_coverage import set_figures, set_values
from sigdb.recognition.metrics_detection import detection_figures
from sigdb.recognition.pod import pod_figures
from sigdb.recognition.split_kinds import changed_parts, make_split, model_form
from sigdb.recognition.splits import TEST
from sigdb.recognition.streamed import feature_batches
from sigdb.recognition.training import Model, usable_rows


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
        The model beside the best possible answer, by noise band: see :func:`~sigdb.recognition.against_bound`. None
        where it was not asked for.
    aims
        What the model should reach, and whether it does: see :func:`~sigdb.recognition.aims.aims`.
    """

    target: str
    learner: str
    split: str
    split_hash: str
    rows: int
    specimens: int
    figures: dict[str, dict[str, Figure]]
    differences: dict[str, dict[str, Figure]] = field(default_factory=dict)
    bound: Mapping[str, Figure] | None = None
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
    bound: Mapping[str, Figure] | None = None,
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
        Figures of the best possible answer to the same rows (:func:`asked_rows`), by name.
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
    rows, tells = _asked(model, database)
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
        if bound is None or _has_seen(model, database, rows)
        else _above(answers[model.learner], rows, model.target, bound, best, inside),
        tables=evaluation_tables(answers, rows, model.learner, best),
    )
    return beside(evaluation, answers[model.learner], rows)


def asked_rows(model: Model, database: Database) -> pd.DataFrame:
    """The rows, by id, that :func:`evaluate` asks a model about."""
    return _asked(model, database)[0]


def answer_figures(answers: Answers, rows: pd.DataFrame, target: str) -> dict[str, Figure]:
    """All figures that answers allow."""
    figures = FIGURES[target](answers.found, rows)
    if answers.detection is not None:
        figures |= detection_figures(answers.detection, rows) | pod_figures(answers.detection, rows)
    if answers.probabilities is not None:
        figures |= calibration_figures(answers.probabilities, rows)
    if answers.sets is not None:
        figures |= set_figures(answers.sets, rows)
    return figures


def answer_values(answers: Answers, rows: pd.DataFrame, target: str) -> dict[str, FloatArray]:
    """Of each row, what those figures that are means are means of."""
    values = {name: one for name, one in VALUES[target](answers.found, rows).items() if not name.startswith("rmse")}
    if answers.probabilities is not None:
        values |= calibration_values(answers.probabilities, rows)
    if answers.sets is not None:
        values |= set_values(answers.sets, rows)
    return values


def _above(
    answers: Answers,
    rows: pd.DataFrame,
    target: str,
    bound: Mapping[str, Figure],
    bound_values: Mapping[str, FloatArray],
    inside: BoolArray,
) -> tuple[str, ...]:
    """Names of the figures that are better than the bound, on the rows that it holds."""
    ours, some = answers.only(inside), rows[inside]
    best = {name: one[inside] for name, one in bound_values.items()}
    figures, values = answer_figures(ours, some, target), answer_values(ours, some, target)
    return figures_above_bound(figures, bound, values, best, some)


def _has_seen(model: Model, database: Database, rows: pd.DataFrame) -> bool:
    """Whether some rows are of specimens of the training, as under S0: the bound is for gears that are not known."""
    return database.manifest.seed == model.seed and bool(rows["specimen"].isin(model.trained_on).any())


def _differences(
    values: Mapping[str, Mapping[str, FloatArray]], learner: str, rows: pd.DataFrame
) -> dict[str, dict[str, Figure]]:
    """The model minus each other estimator, of the figures that both have."""
    specimens, ours = Specimens(rows["specimen"]), values[learner]
    return {
        other: {name: specimens.mean(ours[name] - theirs[name]) for name in ours if name in theirs}
        for other, theirs in values.items()
        if other != learner
    }


def _asked(model: Model, database: Database) -> tuple[pd.DataFrame, str]:
    """The rows that a model is asked about, and what they tell."""
    rows = usable_rows(database, model.target)
    if database.sensors[0] != model.sensor:
        raise InputError(f"the model reads {model.sensor!r}, {database.store} holds {database.sensors[0]!r} first")
    if database.manifest.hash == model.database_hash and model.split != "S1":
        rows, tells = _of_split(model, database, rows)
    else:
        rows, tells = _of_others(model, database, rows)
    if rows.empty:
        raise InputError(
            f"every specimen of {database.store} was used in training; evaluate on a database with another seed"
        )
    if model.target == "severity":
        rows = rows[rows["tooth"] > 0]
        if rows.empty:
            raise InputError(f"{database.store} has no damaged rows, and severity is judged on them")
    return rows, tells


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
    return {name: Answers.joined(parts) for name, parts in found.items()}


def _of_split(model: Model, database: Database, rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Test rows of the split that the model was trained by, on the database that it was trained on."""
    split = make_split(model.split, rows, seed=model.seed, folds=model.folds)
    if split.hash != model.split_hash:
        raise InputError(
            f"{database.store} was extended since the model was trained, and the split {model.split} of its rows is "
            "another one now; train again"
        )
    return rows[split.folds(rows) == TEST], f"{split.name}, {split.tells}"


def _of_others(model: Model, database: Database, rows: pd.DataFrame) -> tuple[pd.DataFrame, str]:
    """Rows of specimens that the model has not seen."""
    same_gears = database.manifest.seed == model.seed
    if same_gears:
        rows = rows[~rows["specimen"].isin(model.trained_on)]
    held_out = "specimens held out of training" if same_gears else "specimens of a database with another seed"
    changed = changed_parts(model.form, model_form(database.manifest.resolved))
    if changed:
        return rows, (
            f"S5, another model form: {database.store}, which differs in {', '.join(changed)}; {held_out}, the cases "
            "of that database"
        )
    same_cases = "the same cases" if database.manifest.hash == model.database_hash else "the cases of another database"
    return rows, f"S1, by specimen: {held_out}, {same_cases}"


def _plain(figures: Mapping[str, Figure]) -> dict[str, dict[str, float | None]]:
    return {
        name: {end: None if np.isnan(value := getattr(one, end)) else value for end in ("value", "low", "high")}
        for name, one in figures.items()
    }
