"""Detection: damaged or not, at a rate of false alarms that is set."""

import math
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import logsumexp
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core.errors import InputError
from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.conformal import row_quantile
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_scores import TemplateScores


class Detector(ClassifierMixin, BaseEstimator):
    """Detection of damage by the likelihood ratio: 1 for a damaged gear, 0 for a healthy one.

    The score is the logarithm of ``p(x | damage) / p(x | none)``, averaged over the templates as the bank weighs them,
    and over the teeth. The threshold is the conformal quantile of the scores of healthy rows, so that a further healthy
    row, exchangeable with these, is above it with a probability of the set rate at most.

    Parameters
    ----------
    bank
        Templates.
    false_alarm_rate
        Rate of false alarms, between 0 and 1.
    n_jobs
        Threads of the scores.

    Attributes
    ----------
    threshold_
        Greatest score of a gear that is called healthy.
    healthy_rows_, healthy_specimens_
        What it was set on. Rows of a specimen resemble each other: with few specimens the rate of one gear pair may be
        another one.
    """

    def __init__(self, bank: TemplateBank, false_alarm_rate: float = 0.01, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.false_alarm_rate = false_alarm_rate
        self.n_jobs = n_jobs

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Set the threshold on the healthy rows; damaged ones do not count.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.
        y
            0 for healthy rows, anything else, such as the first damaged tooth, for damaged ones.
        groups
            Specimen of each row; each row counts as its own if left out.

        Raises
        ------
        InputError
            If the rate is not between 0 and 1, or takes more healthy rows: ``1 / rate - 1`` at least.
        """
        rate = self.false_alarm_rate
        if not 0 < rate < 1:
            raise InputError(f"false_alarm_rate = {rate:g} must be between 0 and 1, such as 0.01")
        healthy = np.asarray(y) == 0
        count, needed = int(healthy.sum()), math.ceil(1 / rate - 1 - 1e-9)
        if count < needed:
            raise InputError(
                f"false_alarm_rate = {rate:g} needs {needed} healthy rows, X has {count}; give more of them, or ask "
                f"for a rate of {1 / (count + 1):.2g} or more"
            )
        groups = np.arange(len(healthy)) if groups is None else np.asarray(groups)
        self.classes_ = np.array([0, 1])
        self.threshold_ = row_quantile(self.log_ratio(X[healthy]), 1 - rate)
        self.healthy_rows_, self.healthy_specimens_ = count, len(np.unique(groups[healthy]))
        return self

    def log_ratio(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) logarithm of the likelihood ratio of damage against none."""
        scores = TemplateScores(self.bank, self.n_jobs).transform(X)
        return np.asarray(logsumexp(scores[:, : max(self.bank.teeth)], axis=1))

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows,) by how much the logarithm of the likelihood ratio is above the threshold; unbounded."""
        check_is_fitted(self)
        return self.log_ratio(X) - self.threshold_

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) 1 for damage, 0 for none."""
        return (self.decision_function(X) > 0).astype(int)
