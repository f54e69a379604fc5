"""Outcomes of a model on rows that do not follow its law: right, not sure, outside, sure and wrong, false alarms."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.database import KIND, SHOWN_QUANTITIES, Database, places_of_kinds, severity_levels
from sigdb.recognition import (
    TSA,
    Answers,
    Batch,
    Model,
    TemplateScores,
    band_edges,
    bands,
    damage_score,
    reduce_averages,
)

RATES = (1e-2, 1e-3)
"""Rates of false alarms at which alarms are counted."""


@dataclass(frozen=True, kw_only=True, eq=False)
class AlarmThresholds:
    """Thresholds of the score of damage in bands of noise, as a detector has them.

    Attributes
    ----------
    edges
        (bands - 1,) edges between the bands, dB.
    thresholds
        (bands,) score that a share of the healthy rows of each band exceeds.
    """

    edges: FloatArray
    thresholds: FloatArray

    @classmethod
    def of(cls, score: FloatArray, noise: FloatArray, rate: float) -> "AlarmThresholds | None":
        """The thresholds on healthy rows of a noise, dB; None where they are fewer than one over the rate.

        A band has twice as many at least.
        """
        if len(score) * rate < 1:
            return None
        edges = band_edges(noise, np.arange(len(noise)), 1 - rate / 2)
        band = bands(edges, noise)
        of_bands = [np.quantile(score[band == k], 1 - rate, method="higher") for k in range(len(edges) + 1)]
        return cls(edges=edges, thresholds=np.array(of_bands))

    def alarms(self, score: FloatArray, noise: FloatArray) -> BoolArray:
        """Return whether rows are alarms, (rows,)."""
        return score > self.thresholds[bands(self.edges, noise)]


@dataclass(frozen=True, kw_only=True)
class Robustness:
    """A model's thresholds, to count its outcomes with.

    Attributes
    ----------
    model
        The model.
    thresholds
        By rate, the thresholds that this share of healthy rows of the database exceeds; None where it has too few.
    """

    model: Model
    thresholds: Mapping[float, AlarmThresholds | None]

    @classmethod
    def of(cls, model: Model, database: Database, rows: pd.DataFrame) -> "Robustness":
        """The thresholds on rows of a database.

        Parameters
        ----------
        model
            A trained model.
        database
            Its database.
        rows
            Rows that it has not seen, of :func:`requested_rows`.
        """
        alone = replace(model, estimators={model.learner: model.estimator})
        reducer, batch = model.estimator.reducer, Batch(table=rows)
        if isinstance(reducer, TemplateScores):
            batch = reduce_averages(database, batch, {reducer.column: reducer}, sensor=model.sensor)
            scores = model.estimator.answer(batch).scores
        else:
            scores = alone.answers(database, rows)[model.learner].scores
        thresholds: dict[float, AlarmThresholds | None] = dict.fromkeys(RATES)
        if scores is not None:
            healthy = rows["tooth"].to_numpy() == 0
            score, noise = damage_score(scores)[healthy], _noise(model, batch)[healthy]
            thresholds = {rate: AlarmThresholds.of(score, noise, rate) for rate in RATES}
        return cls(model=model, thresholds=thresholds)

    def outcomes(self, rows: pd.DataFrame) -> dict[str, float]:
        """Return the outcomes on rows: shares, and rates of false alarms.

        Parameters
        ----------
        rows
            Rows with the columns that models read, ``tooth`` and the severities.

        Returns
        -------
        dict
            With the keys, nan where a number is not known:

            - ``rows``;
            - ``right``, ``not_sure``, ``outside`` and ``sure_wrong``: shares that add up to 1;
            - ``alarms_0.01``, ``alarms_0.001``: shares of healthy rows above that rate's threshold in their band of
              noise and not outside;
            - ``errors``: share of rows whose most probable answer of location is wrong, however unsure.
        """
        batch = self._batch(rows)
        verdict = self.model.assess(batch)
        outside = verdict["outside"].to_numpy(bool)
        answers = self.model.estimator.answer(batch)
        right, sure = self._right_and_sure(rows, answers)
        shares = {
            "right": right & sure & ~outside,
            "not_sure": ~sure & ~outside,
            "outside": outside,
            "sure_wrong": ~right & sure & ~outside,
        }
        numbers = {"rows": float(len(rows))} | {name: float(some.mean()) for name, some in shares.items()}
        healthy = rows["tooth"].to_numpy() == 0
        for rate, thresholds in self.thresholds.items():
            numbers[f"alarms_{rate:g}"] = np.nan
            if answers.scores is not None and healthy.any() and thresholds is not None:
                alarms = thresholds.alarms(damage_score(answers.scores), _noise(self.model, batch))
                numbers[f"alarms_{rate:g}"] = float(np.mean((alarms & ~outside)[healthy]))
        numbers["errors"] = self._errors(rows, answers)
        return numbers

    def _batch(self, rows: pd.DataFrame) -> Batch:
        estimator = self.model.estimator
        batch = Batch.from_rows(rows, (estimator.columns_read | {TSA}) & {*rows.columns})
        reducers = self.model.reducers.values()
        return replace(batch, reduced={reducer.column: reducer.transform(batch) for reducer in reducers})

    def _right_and_sure(self, rows: pd.DataFrame, answers: Answers) -> tuple[BoolArray, BoolArray]:
        """Return whether each answer is right, and whether the model is sure of it, (rows,) each."""
        every = np.ones(len(rows), bool)
        if isinstance(answers.predicted, pd.DataFrame):
            names = [name for name in SHOWN_QUANTITIES if f"{name}_low" in answers.predicted]
            ends = {name: (answers.predicted[f"{name}_low"], answers.predicted[f"{name}_high"]) for name in names}
            levels = severity_levels(rows, names)
            inside = [(value.between(*ends[str(name)]) | value.isna()).to_numpy() for name, value in levels.items()]
            return np.all([every, *inside, rows["tooth"].to_numpy() > 0], axis=0), every
        true = self._true(rows, answers)
        if answers.sets is None:
            return np.asarray(answers.predicted == true), every
        sure = answers.sets.sum(axis=1) == 1
        named = answers.sets.argmax(axis=1)
        return np.where(sure, named == true, answers.predicted == true), sure

    def _true(self, rows: pd.DataFrame, answers: Answers) -> IntArray:
        """Return the true answers as numbers, (rows,): 1 for damage, the tooth, or the place of the kind of damage."""
        if answers.classes:
            return places_of_kinds(rows[KIND], answers.classes)
        tooth = rows["tooth"].to_numpy(int)
        return np.minimum(tooth, 1) if self.model.target == "detection" else tooth

    def _errors(self, rows: pd.DataFrame, answers: Answers) -> float:
        if self.model.target != "location" or isinstance(answers.predicted, pd.DataFrame):
            return np.nan
        return float(np.mean(answers.predicted != rows["tooth"].to_numpy()))


def _noise(model: Model, batch: Batch) -> FloatArray:
    """Return the noise of averages, (rows,) dB: relative to the healthy signal where the model has templates."""
    reducer = model.estimator.reducer
    return reducer.noise_db(batch) if isinstance(reducer, TemplateScores) else batch.noise_db()
