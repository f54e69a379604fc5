"""An estimator of a user's own, with scikit-learn's conventions, among those of the registry."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from sklearn.base import clone

from sigdb.core import FloatArray, InputError, IntArray, shown
from sigdb.database import KIND, Database, inputs, kind_classes, labels_of, places_of_kinds
from sigdb.recognition.answers import Answers
from sigdb.recognition.estimators.contract import Estimator, Labels
from sigdb.recognition.rows.batch import Batch, Rows

_LEAST_PROBABILITY = 1e-300
"""Least probability whose logarithm counts."""


class UserEstimator(Estimator):
    """A user's estimator that reads the input columns of a database's rows.

    Parameters
    ----------
    estimator
        Anything with ``fit(X, y)`` and ``predict(X)``; for probabilities ``predict_proba(X)`` and ``classes_``. A copy
        is trained where scikit-learn can copy it.
    target
        ``location``, ``severity``, ``detection`` or ``kind``.
    database
        Database of all rows that it will see.
    columns_of_x
        Input columns, see :meth:`sigdb.database.Database.xy`.
    drawn_rows
        Whether it is trained on the rows that are drawn for the baselines, in place of all.

    Attributes
    ----------
    estimator_
        The trained estimator.
    """

    def __init__(
        self,
        estimator: Any,
        target: str,
        database: Database,
        columns_of_x: Sequence[str] = (),
        drawn_rows: bool = False,
    ) -> None:
        self.estimator = estimator
        self.target = target
        self.database = database
        self.columns_of_x = columns_of_x
        self.drawn_rows = drawn_rows

    @property
    def learns_from_all(self) -> bool:
        """Whether it is trained on all rows."""
        return not self.drawn_rows

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Train on rows of the database, by their ids; of severity on damaged rows.

        Raises
        ------
        InputError
            If the estimator cannot be trained on them, with its own message.
        """
        rows = self._batch(X).table
        rows = rows[rows["tooth"] > 0] if self.target == "severity" else rows
        self.estimator_ = clone(self.estimator, safe=False)
        labels = labels_of(self.target, rows)
        self.quantities_ = tuple(map(str, labels.columns)) if isinstance(labels, pd.DataFrame) else ()
        self.kinds_ = kind_classes(map(str, np.ravel(labels))) if self.target == KIND else ()
        self._called("fit", self._inputs(rows.index), labels.to_numpy())
        return self

    def predict(self, X: Rows) -> IntArray | pd.DataFrame:
        """Return the predictions for rows of the database, by their ids."""
        return self.answer(X).predicted

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with probabilities where the estimator has some.

        Raises
        ------
        InputError
            If the estimator fails, or its answers are of another shape.
        """
        batch = self._batch(X)
        x = self._inputs(batch.index)
        predicted = np.asarray(self._called("predict", x))
        if self.target == "severity":
            expected: tuple[int, ...] = (len(batch), len(self.quantities_))
        else:
            expected = (len(batch),)
        if predicted.shape != expected:
            raise InputError(f"{self.name}: predict returned the shape {predicted.shape}; return {expected}")
        if self.target == "severity":
            return Answers(
                predicted=pd.DataFrame(predicted.astype(float), columns=list(self.quantities_), index=batch.index)
            )
        predicted = self._places(predicted)
        if not hasattr(self.estimator_, "predict_proba"):
            return Answers(predicted=predicted, classes=self.kinds_)
        probabilities = self._probabilities(x, batch)
        scores = np.log(np.maximum(probabilities, _LEAST_PROBABILITY))
        if self.target == "detection":
            return Answers(predicted=predicted, scores=scores[:, 1] - scores[:, 0])
        return Answers(predicted=predicted, scores=scores, probabilities=probabilities, classes=self.kinds_)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of damage of the training rows, where it answers which."""
        return getattr(self, "kinds_", ())

    @property
    def name(self) -> str:
        """Name of the estimator's class."""
        return type(self.estimator).__name__

    def _inputs(self, ids: pd.Index) -> pd.DataFrame:
        return inputs(self.database, ids.to_numpy(), self.columns_of_x)

    def _probabilities(self, x: pd.DataFrame, batch: Batch) -> FloatArray:
        """Return the probabilities of 'none' and of each tooth, (rows, teeth + 1); of detection of no and of damage."""
        values = np.asarray(self._called("predict_proba", x), float)
        classes = self._places(getattr(self.estimator_, "classes_", self.kinds_ or np.arange(values.shape[-1])))
        if values.shape != (len(batch), len(classes)) or not np.allclose(values.sum(axis=1), 1, atol=1e-3):
            raise InputError(
                f"{self.name}: predict_proba returned the shape {values.shape} for {len(batch)} rows and "
                f"{len(classes)} classes; return a row of probabilities, whose sum is 1, for each"
            )
        most = {"detection": 1, KIND: len(self.kinds_) - 1}.get(self.target)
        most = int(max(classes.max(), batch.table["teeth"].max())) if most is None else most
        whole = np.zeros((len(batch), most + 1))
        whole[:, classes] = values
        return whole

    def _places(self, labels: ArrayLike) -> IntArray:
        """Return labels as numbers; kinds of damage by their places among those of the training."""
        if self.target != KIND:
            return np.asarray(labels).astype(int)
        places = places_of_kinds(np.asarray(labels).astype(str).tolist(), self.kinds_)
        if (places < 0).any():
            wrong = np.asarray(labels)[int((places < 0).argmax())]
            raise InputError(f"{self.name} answered {wrong!r}, which is no kind of the training: {self.kinds_}")
        return places

    def _called(self, method: str, *arguments: Any) -> Any:
        try:
            return getattr(self.estimator_, method)(*arguments)
        except Exception as error:  # a user's estimator may do anything
            text = " ".join(str(error).split())
            raise InputError(f"{self.name}.{method}: {type(error).__name__}: {text}"[:400]) from error


def user_estimator(
    estimator: object, target: str, database: Database, columns: Sequence[str], *, drawn_rows: bool = False
) -> UserEstimator:
    """Return a user's estimator as one of those that are compared.

    Raises
    ------
    InputError
        If it has no ``fit`` or ``predict``.
    """
    for method in ("fit", "predict"):
        if not callable(getattr(estimator, method, None)) or isinstance(estimator, type):
            raise InputError(
                f"model = {shown(estimator)} has no method {method}; give a model of sigdb, or an instance of an "
                "estimator with fit and predict"
            )
    return UserEstimator(estimator, target, database, columns, drawn_rows)
