"""Evaluated rows: rows of a database, the answers of an estimator to them, and their specimens."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self, cast

import pandas as pd

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.database import KIND, places_of_kinds, severity_levels
from sigdb.recognition.answers import Answers
from sigdb.recognition.metrics.estimate import Specimens
from sigdb.recognition.metrics.location_and_severity import quantities_of
from sigdb.recognition.metrics.metric import Metric

OUTSIDE_METRICS = (Metric(name="outside", title="share outside"),)
"""The share of rows that the model says it was not trained for; other metrics count its answers to them too."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluated:
    """Rows with the answers of one estimator. All estimators of an evaluation share rows and specimens.

    Attributes
    ----------
    rows
        By id: ``tooth``, ``teeth``, ``specimen``, operating point, noise and severity of each row; of answers of
        severity, nan where its damage does not have a quantity.
    answers
        Answers of the estimator to these rows.
    specimens
        Specimens of the rows, resampled once for all metrics.
    """

    rows: pd.DataFrame
    answers: Answers
    specimens: Specimens

    @classmethod
    def of(cls, answers: Answers, rows: pd.DataFrame) -> Self:
        """Return rows and answers with specimens of their own resamples."""
        return cls(rows=_labelled(rows, answers), answers=answers, specimens=Specimens(rows["specimen"]))

    @classmethod
    def of_each(cls, answers: Mapping[str, Answers], rows: pd.DataFrame) -> dict[str, Self]:
        """Return the same rows with the answers of each estimator, by its name; their specimens are resampled once."""
        specimens = Specimens(rows["specimen"])
        return {
            name: cls(rows=_labelled(rows, each), answers=each, specimens=specimens) for name, each in answers.items()
        }

    def select(self, inside: BoolArray) -> Self:
        """Return some of the rows, by a mask (rows,)."""
        if inside.all():
            return self
        return type(self)(
            rows=self.rows[inside], answers=self.answers.select(inside), specimens=self.specimens.select(inside)
        )

    @property
    def true(self) -> IntArray:
        """(rows,) place of the true answer: the tooth, 0 for none; or the place of the kind of damage among classes."""
        if not self.answers.classes:
            return self.rows["tooth"].to_numpy(int)
        return places_of_kinds(self.rows[KIND], self.answers.classes)

    @property
    def labels(self) -> IntArray:
        """(rows,) predicted tooth, 0 for none; of a detector 1 for damage; or the place of the predicted class."""
        return cast(IntArray, self.answers.predicted)

    @property
    def severities(self) -> pd.DataFrame:
        """Predicted severities, with the ends of their intervals."""
        return cast(pd.DataFrame, self.answers.predicted)

    @property
    def score(self) -> FloatArray | None:
        """(rows,) score of damage; None where the estimator has none."""
        return self.answers.detection

    @property
    def outside_values(self) -> dict[str, FloatArray]:
        """Values of :data:`OUTSIDE_METRICS`; none where the estimator does not say."""
        outside = self.answers.outside
        return {} if outside is None else {"outside": outside.astype(float)}

    @property
    def healthy(self) -> BoolArray:
        """(rows,) whether a row is of a healthy gear."""
        return (self.rows["tooth"] == 0).to_numpy()


def _labelled(rows: pd.DataFrame, answers: Answers) -> pd.DataFrame:
    """Return rows with the true values of the quantities of answers of severity; others as they are."""
    if not isinstance(answers.predicted, pd.DataFrame):
        return rows
    return rows.assign(**severity_levels(rows, quantities_of(answers.predicted)))
