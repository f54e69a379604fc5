"""Answers of an estimator to rows, with scores, probabilities and sets where it gives them."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from sigdb.core import Answer, BoolArray, FloatArray, IntArray
from sigdb.database import SHOWN_QUANTITIES
from sigdb.transmission import SIZES


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


def without_improbable(predicted: pd.DataFrame) -> pd.DataFrame:
    """Return severities without the sizes, and their details, that damage hardly has: nan for these.

    Damage hardly has a size where its probability is below 0.01.

    Parameters
    ----------
    predicted
        Severities as an estimator predicts them, see :func:`severity_sentences`.
    """
    kept = predicted.copy()
    for size in SIZES:
        if f"{size}_probability" in kept:
            names = [f"{name}{end}" for name in (size, *SIZES[size]) for end in ("", "_low", "_high")]
            improbable = kept[f"{size}_probability"] < _IMPROBABLE
            kept.loc[improbable, [name for name in names if name in kept]] = np.nan
    return kept


def severity_sentences(predicted: pd.DataFrame, most: Mapping[str, float] | None = None) -> list[str]:
    """Return a sentence on the severity of each row: its sizes with their intervals, and the number of damaged teeth.

    Where damage is of several kinds, sizes that it probably does not have are left out.

    Parameters
    ----------
    predicted
        Severities as an estimator predicts them.
    most
        By quantity, the greatest value in the training: an interval that ends there says that it may be more.

    Examples
    --------
    >>> severity_sentences(pd.DataFrame({"crack_depth": [2e-3], "crack_depth_low": 1e-3, "crack_depth_high": 3e-3}))
    ['If a tooth is damaged, its crack depth is 2 mm (1 to 3).']
    """
    names = [name for name in SHOWN_QUANTITIES if name in predicted]
    return [_severity_sentence(row, names, most or {}) for row in predicted.to_dict("records")]


def _severity_sentence(row: Mapping[Hashable, float], names: Sequence[str], most: Mapping[str, float]) -> str:
    shares = {name: row[f"{name}_probability"] for name in names if f"{name}_probability" in row}
    likely = max(shares, key=lambda name: shares[name], default="")
    texts = []
    for name in names:
        shown = SHOWN_QUANTITIES[name]
        size = next((size for size, details in SIZES.items() if name in details), name)
        if np.isnan(row[name]) or (size in shares and size != likely and shares[size] < _PROBABLE):
            continue
        ends = [row.get(f"{name}_{end}", np.nan) * shown.factor for end in ("low", "high")]
        more = " or more" if row.get(f"{name}_high", -np.inf) >= most.get(name, np.inf) else ""
        interval = f" ({ends[0]:.3g} to {ends[1]:.3g}{more})" if ends[0] < ends[1] else more
        share = f", with probability {shares[name]:.2f}" if name in shares else ""
        subject = "the number of damaged teeth" if name == "damaged_teeth" else f"its {shown.title}"
        texts.append(f"{subject} is {shown.text(row[name])}{interval}{share}")
    return f"If a tooth is damaged, {listed(texts)}."


def listed(texts: Sequence[str]) -> str:
    """Return texts as part of a sentence.

    Examples
    --------
    >>> listed(["a", "b", "c"])
    'a, b and c'
    """
    return " and ".join(filter(None, [", ".join(texts[:-1]), *texts[-1:]]))


_IMPROBABLE = 0.01
"""Probability below which damage counts as not having a size."""

_PROBABLE = 0.5
"""Probability from which on damage counts as having a size."""


def _stacked(arrays: Sequence[np.ndarray], absent: float) -> np.ndarray:
    """Return the rows of arrays one below the other, those of fewer classes filled up."""
    if arrays[0].ndim == 1:
        return np.concatenate(arrays)
    width = max(array.shape[1] for array in arrays)
    return np.concatenate(
        [np.pad(array, ((0, 0), (0, width - array.shape[1])), constant_values=absent) for array in arrays]
    )
