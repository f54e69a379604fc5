"""A model beside the best possible answer to the same rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray
from sigdb.database import Database
from sigdb.recognition.against_bound import against_bound
from sigdb.recognition.against_bound_severity import posterior_answers
from sigdb.recognition.aims import aims
from sigdb.recognition.answers import Answers
from sigdb.recognition.bayes_bound import Bound, bound
from sigdb.recognition.bootstrap import Figure, Specimens
from sigdb.recognition.causes import causes
from sigdb.recognition.detection_bound import detection_bound
from sigdb.recognition.evaluation import Evaluation, asked_rows, evaluate
from sigdb.recognition.metrics import severity_values
from sigdb.recognition.metrics_detection import detection_figures, roc
from sigdb.recognition.pod import pod_figures
from sigdb.recognition.rows_by_point import OperatingPoint, operating_points
from sigdb.recognition.training import Model


def evaluate_beside_bound(model: Model, database: Database) -> Evaluation:
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
    rows = asked_rows(model, database)
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
        best = bound(database, rows.index, among=rows.index, target=target, sensor=model.sensor)
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
    def figures(self) -> dict[str, Figure]:
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
    if isinstance(answers.found, pd.DataFrame):
        return any(str(name).endswith("_low") for name in answers.found)
    return answers.sets is not None
