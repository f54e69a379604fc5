"""What an estimator says of rows: its answer, and scores, probabilities and sets where it has them."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from scipy.special import logsumexp, softmax

from sigdb.core import BoolArray, FloatArray, IntArray

_AT_ONCE = 8192


@dataclass(frozen=True, kw_only=True)
class Answers:
    """Answers of one estimator.

    Attributes
    ----------
    predicted
        Of location (rows,) tooth, 0 for none; of detection (rows,) 1 for damage, 0 for none; of severity a frame, see
        :meth:`SeverityRegressor.predict`.
    scores
        (rows, 1 + teeth) unbounded scores of 'none' and of each tooth, from ``decision_function``; (rows,) of damage
        alone, from that of a detector or from ``indicator``.
    probabilities
        (rows, 1 + teeth) of 'none' and of each tooth, of an estimator with ``predict_proba``.
    sets
        (rows, 1 + teeth) whether each class is in the conformal set, of an estimator with ``predict_set``.
    """

    predicted: IntArray | pd.DataFrame
    scores: FloatArray | None = None
    probabilities: FloatArray | None = None
    sets: BoolArray | None = None

    @classmethod
    def of(cls, estimator: Any, rows: pd.DataFrame) -> Self:
        """Ask an estimator about rows, some at once, so that memory does not grow with their views.

        Scores are computed once: of an estimator with a ``decision_function`` the answer is where it is greatest, a
        detector's whether it is above 0, and probabilities are its softmax. Where an estimator can tell the sets of
        scores, ``sets_of_scores(scores, X)``, it is asked for that, else for ``predict_set(X)``.
        """
        starts = range(0, len(rows), _AT_ONCE)
        return cls.concatenate([cls._of(estimator, rows.iloc[start : start + _AT_ONCE]) for start in starts])

    @classmethod
    def _of(cls, estimator: Any, X: pd.DataFrame) -> Self:
        if hasattr(estimator, "indicator"):
            return cls(predicted=estimator.predict(X), scores=estimator.indicator(X))
        if not hasattr(estimator, "decision_function"):
            return cls(predicted=estimator.predict(X))
        scores = estimator.decision_function(X)
        if scores.ndim == 1:
            return cls(predicted=(scores > 0).astype(int), scores=scores)
        return cls(
            predicted=scores.argmax(axis=1),
            scores=scores,
            probabilities=softmax(scores, axis=1) if hasattr(estimator, "predict_proba") else None,
            sets=_sets(estimator, scores, X),
        )

    @classmethod
    def concatenate(cls, parts: Sequence[Self]) -> Self:
        """Answers to some rows and to further ones; where tooth counts differ, teeth that a gear does not have count
        as those of :class:`LocationClassifier` do."""
        names = [one.name for one in fields(cls)]
        return cls(**{name: _joined([getattr(part, name) for part in parts], _ABSENT.get(name, 0.0)) for name in names})

    @property
    def damage_only(self) -> bool:
        """Whether scores are of damage alone."""
        return self.scores is not None and self.scores.ndim == 1

    def select(self, inside: BoolArray) -> Self:
        """Answers to some of the rows."""
        parts = {one.name: getattr(self, one.name) for one in fields(self)}
        return replace(self, **{name: part[inside] for name, part in parts.items() if part is not None})

    @property
    def detection(self) -> FloatArray | None:
        """(rows,) score of damage, unbounded: the log odds of any tooth against none, or the score of a detector; None
        without scores."""
        return None if self.scores is None else damage_score(self.scores)


def damage_score(scores: FloatArray) -> FloatArray:
    """(rows,) score of damage: scores of damage alone as they are; of scores (rows, 1 + teeth) of 'none' and of each
    tooth the log odds of any tooth against none."""
    if scores.ndim == 1:
        return scores
    return np.asarray(logsumexp(scores[:, 1:], axis=1) - scores[:, 0])


_ABSENT = {"scores": -np.inf, "probabilities": 0.0, "sets": False}


def _sets(estimator: Any, scores: FloatArray, X: pd.DataFrame) -> BoolArray | None:
    if hasattr(estimator, "sets_of_scores"):
        return np.asarray(estimator.sets_of_scores(scores, X))
    return np.asarray(estimator.predict_set(X)) if hasattr(estimator, "predict_set") else None


def _joined(pieces: list[Any], absent: float) -> Any:
    if pieces[0] is None:
        return None
    if isinstance(pieces[0], pd.DataFrame):
        return pd.concat(pieces)
    if pieces[0].ndim == 1:
        return np.concatenate(pieces)
    width = max(one.shape[1] for one in pieces)
    padded = [np.pad(one, ((0, 0), (0, width - one.shape[1])), constant_values=absent or 0) for one in pieces]
    return np.concatenate(padded)
