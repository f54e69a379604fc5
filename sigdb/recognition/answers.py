"""What an estimator says of rows: its answer, and scores, probabilities and sets where it has them."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from scipy.special import logsumexp

from sigdb.core.typing import BoolArray, FloatArray, IntArray

_AT_ONCE = 8192


@dataclass(frozen=True, kw_only=True)
class Answers:
    """Answers of one estimator.

    Attributes
    ----------
    found
        Of location (rows,) tooth, 0 for none; of severity a frame, see :meth:`SeverityRegressor.predict`.
    scores
        (rows, 1 + teeth) unbounded scores of 'none' and of each tooth, from ``decision_function``.
    probabilities
        (rows, 1 + teeth) from ``predict_proba``.
    sets
        (rows, 1 + teeth) whether each class is in the conformal set, from ``predict_set``.
    """

    found: IntArray | pd.DataFrame
    scores: FloatArray | None = None
    probabilities: FloatArray | None = None
    sets: BoolArray | None = None

    @classmethod
    def of(cls, estimator: Any, rows: pd.DataFrame) -> Self:
        """Ask an estimator about rows, some at once, so that memory does not grow with their views."""
        pieces = [rows.iloc[start : start + _AT_ONCE] for start in range(0, len(rows), _AT_ONCE)]
        return cls(
            found=_joined([estimator.predict(piece) for piece in pieces]),
            **{
                name: _joined([getattr(estimator, method)(piece) for piece in pieces])
                for name, method in _METHODS.items()
                if hasattr(estimator, method)
            },
        )

    @property
    def detection(self) -> FloatArray | None:
        """(rows,) score of damage: the log odds of any tooth against none, unbounded; None without scores."""
        if self.scores is None:
            return None
        return np.asarray(logsumexp(self.scores[:, 1:], axis=1) - self.scores[:, 0])


_METHODS = {"scores": "decision_function", "probabilities": "predict_proba", "sets": "predict_set"}


def _joined(pieces: list[Any]) -> Any:
    if isinstance(pieces[0], pd.DataFrame):
        return pd.concat(pieces)
    return np.concatenate(pieces)
