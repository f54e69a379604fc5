"""The baseline of the whitened bank: the likelihoods of the templates as they are."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import softmax
from sklearn.base import BaseEstimator, ClassifierMixin

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.calibration import with_none
from sigdb.recognition.streamed import reduced
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_scores import TemplateScores


class WhitenedBankLocation(ClassifierMixin, BaseEstimator):
    """The tooth of the greatest log-likelihood ratio of :class:`TemplateScores`, none where all are below 0.

    Nothing is learnt from rows: :class:`TemplateLocation` without its calibration.

    Parameters
    ----------
    bank
        Templates.
    n_jobs
        Threads of the scores.
    """

    def __init__(self, bank: TemplateBank, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.n_jobs = n_jobs

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Learn nothing."""
        self.classes_ = np.arange(max(self.bank.teeth) + 1)
        return self

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) 0 for none, and the log-likelihood ratio of each tooth."""
        ratio = reduced(TemplateScores(self.bank, self.n_jobs), X)[:, : max(self.bank.teeth)]
        return with_none(ratio, 1.0, 0.0)

    def predict_proba(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) probability of 'none' and of each tooth, if both kinds are as likely beforehand."""
        return softmax(self.decision_function(X), axis=1)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) first damaged tooth, 0 for none."""
        return self.decision_function(X).argmax(axis=1)
