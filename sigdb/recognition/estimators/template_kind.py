"""Calibrated kind of damage from scores of templates, with sets of kinds and a verdict where no template fits."""

from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import FloatArray, IntArray, NotApplicableError
from sigdb.database import places_of_kinds
from sigdb.recognition.answers import Answers
from sigdb.recognition.estimators.contract import Labels
from sigdb.recognition.estimators.pooled_kind import kind_labels
from sigdb.recognition.estimators.template_location import TemplateLocation
from sigdb.recognition.rows.batch import Batch, Rows
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.local_templates import LocalTemplates
from sigdb.recognition.templates.posterior import posterior
from sigdb.recognition.templates.scores import Law, TemplateScores

_TESTS = ("reduced_chi2", "surprise", "surprise_place", "noise")


class KindScores(TemplateScores):
    """Scores of averages by kind of damage, against a bank of templates.

    As :class:`TemplateScores`, but the first scores are those of each kind k, ``log p(x | damage of the kind k) /
    p(x | none)``, whatever the tooth. Templates weigh as in the bank. Then come ``reduced_chi2``, ``surprise``,
    ``surprise_place`` and ``noise``.

    Parameters
    ----------
    bank
        Templates.
    n_jobs
        Threads, as in joblib.
    """

    def __init__(self, bank: TemplateBank, n_jobs: int | None = None) -> None:
        super().__init__(bank, n_jobs, severity=False)

    @property
    def column(self) -> str:
        """Name of the scores among those of other reducers."""
        return "template_kind_scores"

    @property
    def _ratios(self) -> int:
        return len(self.bank.kinds) - 1

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[np.object_]:
        """Return the names of the scores."""
        return np.array([*self.bank.kinds[1:], *_TESTS], dtype=object)

    def _ratio_and_severity(
        self, local: LocalTemplates, each: FloatArray, likelihood: FloatArray, law: Law
    ) -> tuple[FloatArray, FloatArray]:
        after = posterior(likelihood, local.log_prior, local.healthy)
        places = places_of_kinds(local.kinds, self.bank.kinds)
        ratio = np.full((len(likelihood), self._ratios), -np.inf)
        log_p = after.log_classes(places)
        ratio[:, : log_p.shape[1] - 1] = log_p[:, 1:] - log_p[:, :1]
        return ratio, np.empty((len(likelihood), 0))


class TemplateKind(TemplateLocation):
    """Kind of damage from a bank of templates: ``none``, or the names of all kinds that the damaged tooth has.

    The scores are the log-likelihood ratios of :class:`KindScores`. They are calibrated as those of
    :class:`TemplateLocation`, with a kind in the place of a tooth: a slope, a level of 'none', conformal sets for each
    kind, severity and operating point, and a threshold of the reduced chi-square.

    Parameters
    ----------
    bank, coverage, n_jobs, coverage_by
        As of :class:`TemplateLocation`.
    """

    @property
    def reducer(self) -> KindScores:
        """Reducer of averages to scores of kinds."""
        return KindScores(self.bank, self.n_jobs)

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Calibrate.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.
        y
            A frame with ``tooth``, ``kind`` and the severities of each row.
        groups
            Specimen of each row; each row counts as its own if left out.

        Raises
        ------
        NotApplicableError
            If the bank does not state the kinds of its templates.
        """
        if len(self.bank.kinds) < 2:
            raise NotApplicableError("the bank does not state the kinds of damage of its templates; make it again")
        super().fit(X, kind_labels(y, self.bank.kinds), groups)
        self.classes_ = np.array(self.bank.kinds)
        return self

    def _classes(self, batch: Batch) -> IntArray:
        """Return the number of kinds of damage, (rows,)."""
        return np.full(len(batch), len(self.bank.kinds) - 1)

    def _ratio_and_reduced_chi2(self, batch: Batch) -> tuple[FloatArray, FloatArray]:
        scores = batch.reduce(self.reducer)
        return scores[:, : -len(_TESTS)], scores[:, -len(_TESTS)]

    def predict(self, X: Rows) -> NDArray[np.str_]:  # type: ignore[override]
        """Return the most probable kind of each row, ``none`` for none; (rows,)."""
        return np.asarray(self.answer(X).named)

    def answer(self, X: Rows) -> Answers:
        """Return the answers to rows, with scores, probabilities and sets of kinds."""
        return replace(super().answer(X), classes=self.bank.kinds)
