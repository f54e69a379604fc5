"""Calibrated damage location from template scores, with sets of answers and a verdict where no template fits."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import softmax
from sklearn.base import ClassifierMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core import Answer, BoolArray, FloatArray, IntArray
from sigdb.recognition.answers import Answers, answer_table
from sigdb.recognition.calibration.conformal import BY_CELL, COVERAGE
from sigdb.recognition.calibration.location_sets import LocationSets, strangeness
from sigdb.recognition.calibration.probabilities import calibrate, check_labels, with_none
from sigdb.recognition.calibration.unfit_reasons import fit_thresholds, unfit_reasons
from sigdb.recognition.estimators.contract import Labels, Scorer, required_bank, specimens_of, tooth_and_severity
from sigdb.recognition.rows.batch import Batch, Rows
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.scores import COLUMNS, TemplateScores

_RENAMED = {"misfit_threshold_": "reduced_chi2_threshold_"}
"""Attributes of fitted estimators by the names that they had in sigdb 0.1.0."""


class TemplateLocation(LocationSets, ClassifierMixin, Scorer):
    """Location of damage from a bank of templates: 0 for none, else the first damaged tooth.

    The scores are the log-likelihood ratios of :class:`TemplateScores`. Fitting learns only:

    - a slope of the scores and a level of 'none', so that their softmax is a calibrated probability;
    - thresholds of conformal sets (:class:`LocationSets`), from rows that were calibrated without their specimens, in
      bands of the noise relative to the bank's healthy signal;
    - thresholds of the reduced chi-square, and of the surprise of the residual.

    Turning the average by j teeth turns the answer by j teeth exactly, in a rig with one mesh; in a train the answer is
    a tooth that the database has damage of. Gears of any tooth count of the bank have an
    answer; others are refused.

    Parameters
    ----------
    bank
        Templates.
    coverage
        Nominal coverage of the sets. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer every
        set holds every answer.
    n_jobs
        Threads of the scores.
    coverage_by
        ``cell`` or ``all``: whether coverage holds in each cell or on average over all rows.

    Attributes
    ----------
    slope_, none_
        Slope of the scores, and level of 'none'.
    prevalence_
        Share of damaged rows that the level is for.
    set_edges_, set_thresholds_
        As of :class:`LocationSets`.
    reduced_chi2_threshold_, surprise_threshold_
        Greatest reduced chi-square, and greatest surprise of the residual, of a row that is not outside the database.
        Models of earlier versions have no surprise.
    """

    reads = COLUMNS
    needs_bank = True
    learns_from_all = True

    def __init__(
        self, bank: TemplateBank, coverage: float = COVERAGE, n_jobs: int | None = None, coverage_by: str = BY_CELL
    ) -> None:
        self.bank = bank
        self.coverage = coverage
        self.n_jobs = n_jobs
        self.coverage_by = coverage_by

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        super().__setstate__({_RENAMED.get(name, name): value for name, value in state.items()})

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted classifier of a bank."""
        return cls(required_bank(bank), coverage_by=settings.coverage_by)

    @property
    def template_bank(self) -> TemplateBank:
        """Bank of templates that it carries."""
        return self.bank

    @property
    def reducer(self) -> TemplateScores:
        """Reducer of averages to scores of the templates."""
        return TemplateScores(self.bank, self.n_jobs, severity=False)

    def detector_scorer(self) -> Scorer:
        """Return the same scores without calibration, which a detector does not need."""
        return WhitenedBankLocation(self.bank, self.n_jobs)

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
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
        batch = self._batch(X)
        ratio, _ = self._ratio_and_reduced_chi2(batch)
        tooth, severity = tooth_and_severity(y)
        check_labels(self._classes(batch), tooth)
        groups = specimens_of(groups, len(tooth))
        self.classes_ = np.arange(ratio.shape[1] + 1)
        self.slope_, self.none_ = calibrate(ratio, tooth)
        self.prevalence_ = float((tooth > 0).mean())
        strange = strangeness(ratio, tooth, groups)
        point, noise = self.bank.nearest(*batch.operating_point()), self.reducer.noise_db(batch)
        self._fit_sets(strange, tooth, severity, point=point, noise=noise, groups=groups)
        self.reduced_chi2_threshold_, self.surprise_threshold_ = fit_thresholds(self.reducer, batch, tooth)
        return self

    def _classes(self, batch: Batch) -> IntArray:
        """Return the number of classes of damage of each row, (rows,): its tooth count."""
        return batch.column("teeth").astype(int)

    def _ratio_and_reduced_chi2(self, batch: Batch) -> tuple[FloatArray, FloatArray]:
        teeth = max(self.bank.teeth)
        scores = batch.reduce(self.reducer)
        return scores[:, :teeth], scores[:, teeth]

    def fits_none(self, X: Rows) -> BoolArray:
        """Return whether none of the templates fits a row, (rows,)."""
        return np.array([bool(reason) for reason in self.unfit_reasons(X)])

    def unfit_reasons(self, X: Rows) -> list[str]:
        """Return why none of the templates fits a row, and where its residual stands out; empty where one does."""
        check_is_fitted(self)
        surprise = getattr(self, "surprise_threshold_", np.inf)
        return unfit_reasons(self.reducer, self._batch(X), reduced_chi2=self.reduced_chi2_threshold_, surprise=surprise)

    def decision_function(self, X: Rows) -> FloatArray:
        """Return unbounded scores of 'none' and of each tooth, (rows, most teeth + 1).

        Their softmax is the probability.
        """
        check_is_fitted(self)
        return with_none(self._ratio_and_reduced_chi2(self._batch(X))[0], self.slope_, self.none_)

    def predict_proba(self, X: Rows) -> FloatArray:
        """Return the probability of 'none' and of each tooth, (rows, most teeth + 1)."""
        return softmax(self.decision_function(X), axis=1)

    def predict_set(self, X: Rows) -> BoolArray:
        """Return whether 'none' and each tooth is in the conformal set of a row, (rows, most teeth + 1)."""
        batch = self._batch(X)
        return self._sets(self.decision_function(batch), self.reducer.noise_db(batch))

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with scores, probabilities and sets."""
        batch = self._batch(X)
        scores = self.decision_function(batch)
        return Answers.of_scores(scores, sets=self._sets(scores, self.reducer.noise_db(batch)))

    def assess(self, X: Rows) -> pd.DataFrame:
        """Return the answers to rows, with their sentences.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.

        Returns
        -------
        pandas.DataFrame
            With the columns:

            - ``kind``: a key of :data:`sigdb.core.ANSWERS`: ``one tooth``, ``nothing stands out``, or
              ``cannot be judged`` where the set holds no damage and a tooth, or where no template fits;
            - ``answer``: the same as a sentence;
            - ``candidates``: the answers of the set, 0 for none;
            - ``reduced_chi2``: squared residual of the most likely template per sample, in standard deviations of the
              noise, about 1 for signals that the database covers.

            ``reduced_chi2`` is not the ``residual_distance`` of :meth:`sigdb.database.Database.match`, which compares
            residuals in standard deviations of the average and is 0 at best.
        """
        check_is_fitted(self)
        batch = self._batch(X)
        reduced_chi2, answers = self._ratio_and_reduced_chi2(batch)[1], self.answer(batch)
        verdicts = [
            Answer.of("cannot be judged", reason=reason) if reason else verdict
            for verdict, reason in zip(answers.verdicts, self.unfit_reasons(batch), strict=True)
        ]
        candidates = pd.Series(answers.candidates, dtype=object)
        table = answer_table(verdicts).assign(candidates=candidates, reduced_chi2=reduced_chi2)
        return table.set_axis(batch.index)


class WhitenedBankLocation(ClassifierMixin, Scorer):
    """The tooth of the greatest log-likelihood ratio of :class:`TemplateScores`, none where all are below 0.

    Nothing is learnt from rows: :class:`TemplateLocation` without its calibration.

    Parameters
    ----------
    bank
        Templates.
    n_jobs
        Threads of the scores.
    """

    reads = COLUMNS
    needs_bank = True
    learns_from_all = True

    def __init__(self, bank: TemplateBank, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.n_jobs = n_jobs

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted classifier of a bank."""
        return cls(required_bank(bank))

    @property
    def template_bank(self) -> TemplateBank:
        """Bank of templates that it carries."""
        return self.bank

    @property
    def reducer(self) -> TemplateScores:
        """Reducer of averages to scores of the templates."""
        return TemplateScores(self.bank, self.n_jobs, severity=False)

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Learn nothing."""
        self.classes_ = np.arange(max(self.bank.teeth) + 1)
        return self

    def decision_function(self, X: Rows) -> FloatArray:
        """Return 0 for none, and the log-likelihood ratio of each tooth, (rows, most teeth + 1)."""
        ratio = self._batch(X).reduce(self.reducer)[:, : max(self.bank.teeth)]
        return with_none(ratio, 1.0, 0.0)

    def predict_proba(self, X: Rows) -> FloatArray:
        """Return the probability of 'none' and of each tooth, if both kinds are as likely beforehand."""
        return softmax(self.decision_function(X), axis=1)

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with scores and probabilities."""
        return Answers.of_scores(self.decision_function(X))
