"""Damage location from template scores: calibrated, with sets of answers and a word for what is not known."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import log_softmax, softmax
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core.typing import BoolArray, FloatArray, IntArray
from sigdb.recognition.calibration import calibrated, check_labels, specimen_folds_of, with_none
from sigdb.recognition.conformal import row_quantile, specimen_quantile
from sigdb.recognition.template_bank import TemplateBank
from sigdb.recognition.template_scores import TemplateScores

COVERED = 0.99
"""Share of the training rows, about, that are within the threshold of *outside the database*."""


class TemplateLocation(ClassifierMixin, BaseEstimator):
    """Location of damage from a bank of templates: 0 for none, else the first damaged tooth.

    The scores are the log-likelihood ratios of :class:`TemplateScores`. All that is learnt is a slope of the scores and
    a level of 'none', so that their softmax is a calibrated probability, and thresholds: of conformal sets, one for
    'none' and one for all teeth (label-conditional), by specimen, from rows that were calibrated without their
    specimens; and of the misfit. Turning the average by j teeth turns the answer by j teeth exactly. Gears of any tooth
    count of the bank have an answer; others are refused.

    Parameters
    ----------
    bank
        Templates.
    coverage
        Nominal coverage of the sets. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer every
        set holds every answer.
    n_jobs
        Threads of the scores.

    Attributes
    ----------
    slope_, none_
        Slope of the scores, and level of 'none'.
    set_thresholds_
        Greatest -log probability within a set, of 'none' and of a tooth.
    misfit_threshold_
        Greatest misfit that is not outside the database.
    """

    def __init__(self, bank: TemplateBank, coverage: float = 0.9, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.coverage = coverage
        self.n_jobs = n_jobs

    def fit(self, X: pd.DataFrame, y: ArrayLike, groups: ArrayLike | None = None) -> Self:
        """Calibrate.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.
        y
            First damaged tooth, 0 for none.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        ratio, misfit = self._ratio_and_misfit(X)
        y = np.asarray(y, dtype=int)
        check_labels(np.isfinite(ratio).sum(axis=1), y)
        groups = np.arange(len(y)) if groups is None else np.asarray(groups)
        self.classes_ = np.arange(ratio.shape[1] + 1)
        self.slope_, self.none_ = calibrated(ratio, y)
        strange = _strangeness(ratio, y, groups)
        self.set_thresholds_ = np.array(
            [specimen_quantile(strange[some], groups[some], self.coverage) for some in (y == 0, y > 0)]
        )
        self.misfit_threshold_ = row_quantile(misfit, COVERED)
        return self

    def _ratio_and_misfit(self, X: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
        teeth = max(self.bank.teeth)
        scores = TemplateScores(self.bank, self.n_jobs).transform(X)
        return scores[:, :teeth], scores[:, teeth]

    def decision_function(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) unbounded scores of 'none' and of each tooth; their softmax is the probability."""
        check_is_fitted(self)
        return with_none(self._ratio_and_misfit(X)[0], self.slope_, self.none_)

    def predict_proba(self, X: pd.DataFrame) -> FloatArray:
        """(rows, most teeth + 1) probability of 'none' and of each tooth."""
        return softmax(self.decision_function(X), axis=1)

    def predict(self, X: pd.DataFrame) -> IntArray:
        """(rows,) first damaged tooth, 0 for none."""
        return self.decision_function(X).argmax(axis=1)

    def predict_set(self, X: pd.DataFrame) -> BoolArray:
        """(rows, most teeth + 1) whether 'none' and each tooth is in the conformal set of a row."""
        return self._sets(self.decision_function(X))

    def _sets(self, scores: FloatArray) -> BoolArray:
        limit = np.repeat(self.set_thresholds_, [1, scores.shape[1] - 1])
        sets = (-log_softmax(scores, axis=1) <= limit) & np.isfinite(scores)
        # A set is not empty: the most probable answer only adds to the coverage.
        sets[np.arange(len(sets)), scores.argmax(axis=1)] = True
        return sets

    def judge(self, X: pd.DataFrame) -> pd.DataFrame:
        """What can be said of rows, in words.

        Returns
        -------
        pandas.DataFrame
            ``answer``: ``"none"``, ``"tooth 6"``, ``"not sure"`` where the set holds more than one answer,
            ``"outside the database"`` where no template fits; ``candidates``: the answers of the set, 0 for none;
            ``misfit``: about 1 for what the database covers.
        """
        check_is_fitted(self)
        ratio, misfit = self._ratio_and_misfit(X)
        sets = self._sets(with_none(ratio, self.slope_, self.none_))
        candidates = [tuple(np.flatnonzero(one).tolist()) for one in sets]
        answer = [_said(one, outside) for one, outside in zip(candidates, misfit > self.misfit_threshold_, strict=True)]
        return pd.DataFrame({"answer": answer, "candidates": candidates, "misfit": misfit}, index=X.index)


def _said(candidates: tuple[int, ...], outside: bool) -> str:
    if outside:
        return "outside the database"
    if len(candidates) != 1:
        return "not sure"
    return f"tooth {candidates[0]}" if candidates[0] else "none"


def _strangeness(ratio: FloatArray, y: IntArray, groups: IntArray) -> FloatArray:
    """(rows,) -log probability of the truth, calibrated on other specimens."""
    strange = np.empty(len(y))
    for inner, outer in specimen_folds_of(groups):
        scores = with_none(ratio[outer], *calibrated(ratio[inner], y[inner]))
        strange[outer] = -log_softmax(scores, axis=1)[np.arange(len(outer)), y[outer]]
    return strange
