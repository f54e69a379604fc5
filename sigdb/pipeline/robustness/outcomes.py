"""Outcomes of a model on rows that do not follow its law: right, not sure, outside, sure and wrong, false alarms."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray
from sigdb.database import QUANTITIES, Database
from sigdb.recognition import (
    DECIBELS,
    TSA,
    Answers,
    Batch,
    Model,
    damage_score,
    error_curve,
    operating_points,
    sensor_in,
)

RATES = (1e-2, 1e-3)
"""Rates of false alarms at which alarms are counted."""

_DRAWS = 400
"""Rows drawn for each level of noise of the curve that gives losses in decibels."""


@dataclass(frozen=True, kw_only=True)
class Robustness:
    """A model's thresholds and best possible answers, to count its outcomes with.

    Attributes
    ----------
    model
        The model.
    thresholds
        By rate, the score of damage that this share of healthy rows of the database exceeds; nan where its healthy rows
        are fewer than one over the rate.
    curve
        (levels, 2) decibels of further noise, and the error of the best possible answer of location there; none where
        there is no bound.
    """

    model: Model
    thresholds: Mapping[float, float]
    curve: FloatArray

    @classmethod
    def of(cls, model: Model, database: Database, rows: pd.DataFrame) -> "Robustness":
        """The thresholds and the bound on rows of a database.

        Parameters
        ----------
        model
            A trained model.
        database
            Its database.
        rows
            Rows that it has not seen, of :func:`requested_rows`.

        Raises
        ------
        NotApplicableError
            If the law of these rows is not known.
        """
        answers = model.answers(database, rows)[model.learner]
        thresholds = dict.fromkeys(RATES, np.nan)
        if answers.scores is not None:
            healthy = np.sort(damage_score(answers.scores)[rows["tooth"].to_numpy() == 0])
            for rate in RATES:
                if len(healthy) * rate >= 1:
                    thresholds[rate] = float(np.quantile(healthy, 1 - rate, method="higher"))
        curve = np.empty((0, 2))
        if model.target == "location":
            sensor = sensor_in(database, model.sensor)
            points, _ = operating_points(database, rows.index, among=rows.index, sensor=sensor)
            levels = DECIBELS[(DECIBELS >= 0) & (DECIBELS != 0.25)]
            errors = error_curve(points, levels, draws=_DRAWS)
            curve = np.column_stack([levels, np.maximum.accumulate(errors.error)])
        return cls(model=model, thresholds=thresholds, curve=curve)

    def outcomes(self, rows: pd.DataFrame, *, known_bound: bool = True) -> dict[str, float]:
        """Return the outcomes on rows: shares, rates of false alarms, and the loss in decibels.

        Parameters
        ----------
        rows
            Rows with the columns that models read, ``tooth`` and the severities.
        known_bound
            Whether the best possible answer is that of the rows of the database.

        Returns
        -------
        dict
            With the keys, nan where a number is not known:

            - ``rows``;
            - ``right``, ``not_sure``, ``outside`` and ``sure_wrong``: shares that add up to 1;
            - ``alarms_0.01``, ``alarms_0.001``: shares of healthy rows above that rate's threshold and not outside;
            - ``loss_db``: the further noise at which the best possible answer has as many errors.
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
        for rate, threshold in self.thresholds.items():
            numbers[f"alarms_{rate:g}"] = np.nan
            if answers.scores is not None and healthy.any() and np.isfinite(threshold):
                alarms = damage_score(answers.scores) > threshold
                numbers[f"alarms_{rate:g}"] = float(np.mean((alarms & ~outside)[healthy]))
        numbers["loss_db"] = self._loss_db(rows, answers) if known_bound else np.nan
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
            inside = [
                rows[name].between(answers.predicted[f"{name}_low"], answers.predicted[f"{name}_high"]).to_numpy()
                for name in QUANTITIES
                if f"{name}_low" in answers.predicted
            ]
            return np.all([every, *inside, rows["tooth"].to_numpy() > 0], axis=0), every
        tooth = rows["tooth"].to_numpy()
        if answers.sets is None:
            true = tooth > 0 if self.model.target == "detection" else tooth
            return np.asarray(answers.predicted == true), every
        sure = answers.sets.sum(axis=1) == 1
        named = answers.sets.argmax(axis=1)
        return np.where(sure, named == tooth, answers.predicted == tooth), sure

    def _loss_db(self, rows: pd.DataFrame, answers: Answers) -> float:
        if not len(self.curve) or isinstance(answers.predicted, pd.DataFrame):
            return np.nan
        error = float(np.mean(answers.predicted != rows["tooth"].to_numpy()))
        levels, errors = self.curve.T
        if error > errors[-1]:
            return np.inf
        return float(np.interp(error, errors, levels))
