"""Damage location from template scores: calibrated, with sets of answers and a word for what is not known."""

from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import softmax
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recognition.calibration.conformal import COVERAGE, row_quantile
from sigdb.recognition.calibration.location_sets import LocationSets, strangeness, tooth_and_severity
from sigdb.recognition.calibration.probabilities import calibrate, check_labels, with_none
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.scores import TemplateScores, noise_at_point

COVERED = 0.99
"""Share of the training rows, about, that are within the threshold of *outside the database*."""


class TemplateLocation(LocationSets, ClassifierMixin, BaseEstimator):
    """Location of damage from a bank of templates: 0 for none, else the first damaged tooth.

    The scores are the log-likelihood ratios of :class:`TemplateScores`. All that is learnt is a slope of the scores and
    a level of 'none', so that their softmax is a calibrated probability, and thresholds: of conformal sets
    (:class:`LocationSets`), from rows that were calibrated without their specimens, in bands of the noise relative to
    the bank's healthy signal; and of the misfit. Turning the average by j teeth turns the answer by j teeth exactly.
    Gears of any tooth count of the bank have an answer; others are refused.

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
    set_edges_, set_thresholds_
        As of :class:`LocationSets`.
    misfit_threshold_
        Greatest misfit that is not outside the database.
    """

    def __init__(self, bank: TemplateBank, coverage: float = COVERAGE, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.coverage = coverage
        self.n_jobs = n_jobs

    def fit(self, X: pd.DataFrame, y: ArrayLike | pd.DataFrame, groups: ArrayLike | None = None) -> Self:
        """Calibrate.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.
        y
            First damaged tooth, 0 for none; or a frame with ``tooth`` and severities, for each of which coverage is to
            hold.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        ratio, misfit = self._ratio_and_misfit(X)
        y, severity = tooth_and_severity(y)
        check_labels(np.isfinite(ratio).sum(axis=1), y)
        groups = np.arange(len(y)) if groups is None else np.asarray(groups)
        self.classes_ = np.arange(ratio.shape[1] + 1)
        self.slope_, self.none_ = calibrate(ratio, y)
        point, noise = noise_at_point(self.bank, X)
        self._fit_sets(strangeness(ratio, y, groups), y, severity, point=point, noise=noise, groups=groups)
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
        return self.sets_of_scores(self.decision_function(X), X)

    def sets_of_scores(self, scores: FloatArray, X: pd.DataFrame) -> BoolArray:
        """The same from scores of the rows that are known already."""
        return self._sets(scores, noise_at_point(self.bank, X)[1])

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
        sets = self._sets(with_none(ratio, self.slope_, self.none_), noise_at_point(self.bank, X)[1])
        candidates = [tuple(np.flatnonzero(one).tolist()) for one in sets]
        answer = [_said(one, outside) for one, outside in zip(candidates, misfit > self.misfit_threshold_, strict=True)]
        return pd.DataFrame({"answer": answer, "candidates": candidates, "misfit": misfit}, index=X.index)


def _said(candidates: tuple[int, ...], outside: bool) -> str:
    if outside:
        return "outside the database"
    if len(candidates) != 1:
        return "not sure"
    return f"tooth {candidates[0]}" if candidates[0] else "none"
