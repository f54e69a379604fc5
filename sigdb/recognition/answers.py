"""Answers of an estimator to rows, with scores, probabilities and sets where it gives them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from sigdb.core import Answer, BoolArray, FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class Answers:
    """Answers of one estimator.

    Attributes
    ----------
    predicted
        Location: first damaged tooth (rows,), 0 for none. Detection: 1 for damage, 0 for none, (rows,). Kind: place
        among ``classes``, (rows,). Severity: a frame, see :meth:`SeverityRegressor.predict`.
    scores
        (rows, 1 + teeth) unbounded scores of 'none' and of each tooth, or of each kind; or (rows,) of damage at any
        tooth.
    probabilities
        (rows, 1 + teeth) of 'none' and of each tooth, or of each kind.
    sets
        (rows, 1 + teeth) whether each class is in the conformal set.
    classes
        Kinds of damage that the answers are of, ``none`` first; empty where they are of teeth.
    outside
        (rows,) whether a row is outside what the model was trained for; None where it does not say.
    """

    predicted: IntArray | pd.DataFrame
    scores: FloatArray | None = None
    probabilities: FloatArray | None = None
    sets: BoolArray | None = None
    outside: BoolArray | None = None
    classes: tuple[str, ...] = ()

    @classmethod
    def of_scores(cls, scores: FloatArray, *, sets: BoolArray | None = None, classes: tuple[str, ...] = ()) -> Self:
        """Return the answers of a classifier: the greatest score, and a softmax for the probabilities.

        Parameters
        ----------
        scores
            (rows, 1 + teeth) unbounded scores of 'none' and of each tooth.
        sets
            (rows, 1 + teeth) whether each class is in the conformal set.
        classes
            Kinds of damage, where the scores are of these.
        """
        probabilities = softmax(scores, axis=1)
        return cls(
            predicted=scores.argmax(axis=1), scores=scores, probabilities=probabilities, sets=sets, classes=classes
        )

    @classmethod
    def concatenate(cls, parts: Sequence[Self]) -> Self:
        """Return the answers to the rows of several parts.

        Where tooth counts differ, teeth that a gear does not have get the score -inf and the probability 0.
        """

        def stack(values: Callable[[Self], np.ndarray | None], absent: float) -> np.ndarray | None:
            arrays = [array for part in parts if (array := values(part)) is not None]
            return _stacked(arrays, absent) if arrays else None

        frames = [part.predicted for part in parts if isinstance(part.predicted, pd.DataFrame)]
        arrays = [part.predicted for part in parts if not isinstance(part.predicted, pd.DataFrame)]
        return cls(
            predicted=pd.concat(frames) if frames else np.concatenate(arrays),
            scores=stack(lambda part: part.scores, -np.inf),
            probabilities=stack(lambda part: part.probabilities, 0.0),
            sets=stack(lambda part: part.sets, False),
            outside=stack(lambda part: part.outside, False),
            classes=parts[0].classes,
        )

    @property
    def named(self) -> "IntArray | NDArray[np.str_] | pd.DataFrame":
        """The predictions as a model returns them: kinds of damage by their names."""
        return np.array(self.classes)[self.predicted] if self.classes else self.predicted

    @property
    def candidates(self) -> list[tuple[int, ...]] | list[tuple[str, ...]]:
        """The answers of the set of each row: teeth, 0 for none, or kinds of damage; none without sets."""
        places = [tuple(np.flatnonzero(members).tolist()) for members in ([] if self.sets is None else self.sets)]
        return [tuple(self.classes[i] for i in some) for some in places] if self.classes else places

    @property
    def verdicts(self) -> list[Answer]:
        """The answer of the set of each row."""
        of_set: Callable[[Any], Answer] = Answer.of_kinds if self.classes else Answer.of_teeth
        return [of_set(members) for members in self.candidates]

    @property
    def damage_only(self) -> bool:
        """Whether scores are of damage at any tooth."""
        return self.scores is not None and self.scores.ndim == 1

    def select(self, rows: BoolArray | IntArray) -> Self:
        """Return the answers to some of the rows, by their places or by whether each is one of them."""
        arrays = {name: getattr(self, name) for name in ("scores", "probabilities", "sets", "outside")}
        return replace(
            self,
            predicted=self.predicted.iloc[rows] if isinstance(self.predicted, pd.DataFrame) else self.predicted[rows],
            **{name: array[rows] for name, array in arrays.items() if array is not None},
        )

    @property
    def detection(self) -> FloatArray | None:
        """Unbounded score of damage, (rows,): see :func:`damage_score`; None without scores."""
        return None if self.scores is None else damage_score(self.scores)


def damage_score(scores: FloatArray) -> FloatArray:
    """Return the score of damage at any tooth, (rows,).

    Scores (rows, 1 + teeth) of 'none' and of each tooth give the log odds of any tooth against none; scores (rows,) are
    those of damage already.
    """
    if scores.ndim == 1:
        return scores
    return np.asarray(logsumexp(scores[:, 1:], axis=1) - scores[:, 0])


NO_TEMPLATE_FITS = "none of the templates fits the average"
"""Reason of rows that cannot be judged since they are unlike all templates."""

MORE_SEVERE = "the damage is more severe than that of all templates"
"""Reason of rows whose severity cannot be judged since their damage is beyond the templates."""


def answer_table(answers: Sequence[Answer]) -> pd.DataFrame:
    """Return ``kind`` and ``answer``, the sentence, of answers."""
    return pd.DataFrame({"kind": [each.kind for each in answers], "answer": [each.sentence for each in answers]})


def _stacked(arrays: Sequence[np.ndarray], absent: float) -> np.ndarray:
    """Return the rows of arrays one below the other, those of fewer classes filled up."""
    if arrays[0].ndim == 1:
        return np.concatenate(arrays)
    width = max(array.shape[1] for array in arrays)
    return np.concatenate(
        [np.pad(array, ((0, 0), (0, width - array.shape[1])), constant_values=absent) for array in arrays]
    )
