"""A trained model with its baselines: what it reads, and how it answers."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import IntArray, NotApplicableError
from sigdb.database import Database
from sigdb.recognition.answers import Answers
from sigdb.recognition.estimators.contract import Estimator
from sigdb.recognition.rows.batch import CELLS, TSA, Batch, Reducer, Rows
from sigdb.recognition.rows.streams import read_averages, read_features, reduce_averages, stream_features

_PROBE = 8


@dataclass(frozen=True, kw_only=True)
class Model:
    """A trained model with the baselines that were trained on the same rows.

    Attributes
    ----------
    target
        ``location``, ``severity`` or ``detection``.
    learner
        Name of the estimator that is the model; the others are for comparison.
    estimators
        Fitted estimators by name: the learners, then the baselines. ``templates`` is missing where the database has
        no bank (:class:`TemplateBank`), and detectors whose healthy rows do not support the false-alarm rate are.
    seed
        Seed of the database that it was trained on.
    trained_on
        Specimens of that database that it has seen.
    database_hash
        Hash of that database.
    form
        Hash of each part of the rig and the solver that the database was made with.
    split, folds, split_hash
        Name of the split that it was trained by, its number of folds, and the hash of its table.
    sensor
        Sensor whose signatures it reads.
    rows
        Number of training rows.
    drawn_rows
        Number of them that most estimators have learnt from, see :func:`train`.
    false_alarm_rate
        Rate that detectors, and the baselines' thresholds, were set at.
    """

    target: str
    learner: str
    estimators: dict[str, Estimator]
    seed: int
    trained_on: tuple[int, ...]
    database_hash: str
    form: dict[str, str]
    split: str
    folds: int
    split_hash: str
    sensor: str
    rows: int
    drawn_rows: int
    false_alarm_rate: float

    @property
    def estimator(self) -> Estimator:
        """The estimator that is the model."""
        return self.estimators[self.learner]

    @property
    def reducers(self) -> dict[str, Reducer]:
        """By name, the reducers of averages of its estimators."""
        return reducers_of(self.estimators.values())

    def predict(self, X: Rows) -> IntArray | pd.DataFrame:
        """Return the predictions of the model.

        Parameters
        ----------
        X
            Rows of features, see :class:`LocationClassifier`, :class:`SeverityRegressor` and :class:`Detector`; with
            averages for the learner ``templates``, see :class:`TemplateScores`.
        """
        return self.estimator.predict(X)

    def answers(self, database: Database, rows: pd.DataFrame) -> dict[str, Answers]:
        """Return the answers of each estimator, read and computed batch by batch.

        Parameters
        ----------
        database
            Where the rows are from.
        rows
            Rows of :func:`usable_rows`.

        Returns
        -------
        dict
            By name of the estimator, in the order of ``rows``. Baselines that do not apply to the rows are left out.

        Raises
        ------
        NotApplicableError
            If the model itself does not apply to the rows.
        """
        needed = reducers_of([self.estimator])
        batch = reduce_averages(database, Batch(table=rows), self.reducers, sensor=self.sensor, needed=needed)
        order: list[IntArray] = []
        parts: dict[str, list[Answers]] = {name: [] for name in self.estimators}
        whole = any(estimator.reads_whole_averages for estimator in self.estimators.values())
        for places, part in stream_features(database, batch):
            some = read_averages(database, part, sensor=self.sensor) if whole else part
            order.append(places)
            for name in list(parts):
                try:
                    parts[name].append(self.estimators[name].answer(some))
                except NotApplicableError:
                    if name == self.learner:
                        raise
                    del parts[name]
        back = np.argsort(np.concatenate(order))
        return {name: Answers.concatenate(pieces).select(back) for name, pieces in parts.items()}

    def probe(self, database: Database, rows: pd.DataFrame) -> Batch:
        """Return a few rows of one tooth count with all that the model reads, for :func:`save_model`."""
        few, reads = few_rows(Batch(table=rows)), self.estimator.reads
        few = read_features(database, few) if CELLS in reads else few
        return read_averages(database, few, sensor=self.sensor) if TSA in reads else few


def few_rows(rows: Batch) -> Batch:
    """Return eight rows, or all of fewer, of the first one's tooth count, in equal steps."""
    teeth = rows.table["teeth"].to_numpy()
    alike = np.flatnonzero(teeth == teeth[0])
    return rows.take(alike[:: max(1, len(alike) // _PROBE)][:_PROBE])


def reducers_of(estimators: Iterable[Estimator]) -> dict[str, Reducer]:
    """Return the reducers of estimators by name."""
    reducers = [estimator.reducer for estimator in estimators]
    return {reducer.column: reducer for reducer in reducers if reducer is not None}
