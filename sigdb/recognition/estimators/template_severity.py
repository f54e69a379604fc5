"""Severity from template scores: the posterior median, with intervals that hold for each severity."""

from dataclasses import replace
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.stats import norm
from sklearn.base import RegressorMixin
from sklearn.utils.validation import check_is_fitted

from sigdb.core import BoolArray, FloatArray, InputError, NotApplicableError
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.answers import MORE_SEVERE, listed
from sigdb.recognition.calibration.conformal import BY_CELL, COVERAGE, COVERED, row_quantile
from sigdb.recognition.calibration.severity_intervals import SeverityIntervals
from sigdb.recognition.calibration.unfit_reasons import fit_thresholds, unfit_reasons
from sigdb.recognition.estimators.contract import (
    Labels,
    SeverityEstimator,
    required_bank,
    severity_labels,
    specimens_of,
)
from sigdb.recognition.rows.batch import Batch, Rows
from sigdb.recognition.settings import RecognitionSettings
from sigdb.recognition.templates.bank import TemplateBank
from sigdb.recognition.templates.scores import COLUMNS, TemplateScores
from sigdb.transmission import SIZES

_CLEARLY_BEYOND = float(norm.isf(1e-3))
"""Least threshold of the score ``beyond``: a row of the most severe templates exceeds it once in a thousand."""


class TemplateSeverity(SeverityIntervals, RegressorMixin, SeverityEstimator):
    """Severity from a bank of templates: the quantities that its damage has, each with an interval.

    The estimate is the median of the posterior given damage that has the quantity, whatever the tooth
    (:class:`TemplateScores`). Nothing is learnt for it from rows. Intervals are those of :class:`SeverityIntervals`.
    Their scale of errors is the posterior's standard deviation ``spread`` plus its mean s0 over the training rows.
    Bands are of the noise relative to the bank's healthy signal.

    Parameters
    ----------
    bank
        Templates.
    coverage
        Nominal coverage of the intervals. It needs ``coverage / (1 - coverage)`` specimens, nine for 0.9; with fewer
        the intervals are the whole range.
    n_jobs
        Threads of the scores.
    coverage_by
        ``cell`` or ``all``: whether coverage holds in each cell or on average over all rows.

    Attributes
    ----------
    levels_, edges_, thresholds_
        As of :class:`SeverityIntervals`.
    floors_
        (quantities,) s0.
    reduced_chi2_threshold_
        Greatest reduced chi-square of a row that is not outside the database; models of version 0.1.0 have none.
    surprise_threshold_
        Greatest surprise of the residual of such a row; models of earlier versions have none.
    beyond_threshold_
        Greatest score ``beyond`` of a row whose damage is not beyond that of the templates.
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

    @classmethod
    def create(cls, name: str, settings: RecognitionSettings, bank: TemplateBank | None) -> Self:
        """Return an unfitted regressor of a bank."""
        return cls(required_bank(bank), coverage_by=settings.coverage_by)

    @property
    def template_bank(self) -> TemplateBank:
        """Bank of templates that it carries."""
        return self.bank

    @property
    def reducer(self) -> TemplateScores:
        """Reducer of averages to scores of the templates."""
        return TemplateScores(self.bank, self.n_jobs)

    def fit(self, X: Rows, y: Labels, groups: ArrayLike | None = None) -> Self:
        """Calibrate on damaged rows; healthy ones do not count.

        Parameters
        ----------
        X
            Rows as :meth:`TemplateScores.transform` takes them.
        y
            ``tooth`` of each row and the bank's quantities, nan where its damage does not have one.
        groups
            Specimen of each row; each row counts as its own if left out.
        """
        labels = severity_labels(y)
        damaged = (labels["tooth"] > 0).to_numpy()
        if not damaged.any():
            raise InputError("y holds no damaged rows, and severity is learnt from them; add some")
        batch, groups = self._batch(X).take(damaged), specimens_of(groups, len(damaged))[damaged]
        severities = self._severities(batch)
        median, spread = severities["median"], severities["spread"]
        tooth = labels.loc[damaged, "tooth"].to_numpy(int)
        self.reduced_chi2_threshold_, self.surprise_threshold_ = fit_thresholds(self.reducer, batch, tooth)
        self.beyond_threshold_ = max(row_quantile(self.reducer.beyond(batch), COVERED), _CLEARLY_BEYOND)
        self.quantities_ = self.bank.quantities
        true = labels.reindex(columns=list(self.quantities_))[damaged].to_numpy(float)
        mean = np.nan_to_num(np.where(np.isnan(true), 0.0, spread).sum(axis=0) / np.isfinite(true).sum(axis=0).clip(1))
        self.floors_ = np.where(mean > 0, mean, 1.0)
        point, noise = self.bank.nearest(*batch.operating_point()), self.reducer.noise_db(batch)
        strange = np.abs(median - true) / (spread + self.floors_)
        self._fit_intervals(strange, true, point=point, noise=noise, groups=groups)
        return self

    def fits_none(self, X: Rows) -> BoolArray | None:
        """Return whether none of the templates fits a row, (rows,); None for a model of version 0.1.0.

        That is so too where the row asks for more damage than the most severe templates have.
        """
        reasons = self.unfit_reasons(X)
        return None if reasons is None else np.array([bool(reason) for reason in reasons])

    def unfit_reasons(self, X: Rows) -> list[str] | None:
        """Return why the templates do not fit a row, or that its damage is more severe; None as :meth:`fits_none`."""
        threshold = getattr(self, "reduced_chi2_threshold_", None)
        if threshold is None:
            return None
        batch = self._batch(X)
        batch = replace(batch, reduced={**batch.reduced, self.reducer.column: batch.reduce(self.reducer)})
        beyond = self.reducer.beyond(batch) > getattr(self, "beyond_threshold_", np.inf)
        surprise = getattr(self, "surprise_threshold_", np.inf)
        reasons = unfit_reasons(self.reducer, batch, reduced_chi2=threshold, surprise=surprise)
        more_severe = f"{MORE_SEVERE}{self._reach}"
        return [more_severe if more else reason for more, reason in zip(beyond, reasons, strict=True)]

    @property
    def _reach(self) -> str:
        """The greatest sizes of the templates, in words."""
        severity = np.concatenate([point.severity[~point.healthy] for point in self.bank.points])
        ends = {
            name: (np.nanmin(values), np.nanmax(values))
            for name, values in zip(self.bank.quantities, severity.T, strict=True)
            if name in SIZES
        }
        return f", which have {listed([_range_text(name, *each) for name, each in ends.items() if any(each)])}"

    def _severities(self, batch: Batch) -> dict[str, FloatArray]:
        severities = self.reducer.severities(batch)
        if np.isnan(severities["median"]).all(axis=1).any():
            raise NotApplicableError(
                "the bank has no template with one severity for all damaged teeth; train on a plain grid"
            )
        return severities

    def predict(self, X: Rows) -> pd.DataFrame:
        """Return estimates and the ends of their intervals, ``NAME_low`` and ``NAME_high``, one row for each of X.

        An estimate is given that the damage has the quantity. Where damage is of several kinds, ``NAME_probability`` is
        that of a size: that the damage, if there is any, has it.
        """
        check_is_fitted(self)
        batch = self._batch(X)
        severities, names = self._severities(batch), self.bank.quantities
        columns = self._with_intervals(
            names, severities["median"], severities["spread"] + self.floors_, self.reducer.noise_db(batch)
        )
        shares = zip(names, severities.get("probability", np.empty((0, 0))).T, strict=False)
        columns |= {f"{name}_probability": share for name, share in shares if name in SIZES}
        return pd.DataFrame(columns, index=batch.index)


def _range_text(name: str, least: float, most: float) -> str:
    shown = SHOWN_QUANTITIES[name]
    if least < 0:
        return f"a {shown.title} of {shown.text(least)} to {shown.text(most)}"
    return f"a {shown.title} of at most {shown.text(most)}"
