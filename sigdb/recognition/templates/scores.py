"""Averages to scores: the log-likelihood ratio of damage at each tooth, and what the templates say of its severity."""

from typing import Any, Self

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, TransformerMixin

from sigdb.core import BoolArray, FloatArray, InputError, IntArray
from sigdb.recognition.calibration.cells import noise_db
from sigdb.recognition.rows.row_matrix import as_matrix
from sigdb.recognition.severity_quantities import QUANTITIES
from sigdb.recognition.templates.bank import PointTemplates, TemplateBank
from sigdb.recognition.templates.posterior import Posterior, posterior

COLUMNS = ("teeth", "speed_rpm", "torque", "averages", "scatter", "tsa")
"""Columns that scores are made of."""

SCORED = "template_scores"
"""Column of rows whose scores are there already."""

OF_SEVERITY = tuple(f"{kind}_{target}" for kind in ("mean", "median", "spread") for target in QUANTITIES)

_ROWS_AT_ONCE = 512


class TemplateScores(TransformerMixin, BaseEstimator):
    """Scores of averages against a bank of templates, by the law of noise and specimens.

    For each tooth t the logarithm of ``p(x | damage from t) / p(x | none)``, where damage is any template, weighed as
    in the bank, and x is normal as in :class:`Hypotheses` at the nearest operating point of the bank. Then ``misfit``,
    the squared residual of the most likely template in standard deviations, divided by the number of samples: about 1
    for a row that the bank covers. Then posterior mean, median and standard deviation (``spread``) of each severity
    given damage, whatever the tooth.

    The noise of an average is taken from its own revolutions: ``scatter / sqrt(averages)``. Turning an average by j
    teeth turns its scores by j teeth exactly, unless harmonic excitations fixed to the shaft are part of the law.

    Parameters
    ----------
    bank
        Templates.
    n_jobs
        Threads, as in joblib.

    Notes
    -----
    There is nothing to learn: specimens of all rows are unseen ones.
    """

    column = SCORED

    def __init__(self, bank: TemplateBank, n_jobs: int | None = None) -> None:
        self.bank = bank
        self.n_jobs = n_jobs

    def __sklearn_is_fitted__(self) -> bool:
        return True

    def fit(self, X: Any = None, y: Any = None) -> Self:
        """Do nothing."""
        return self

    @property
    def _most_teeth(self) -> int:
        return max(self.bank.teeth)

    def get_feature_names_out(self, input_features: Any = None) -> NDArray[np.object_]:
        """Names of the scores."""
        teeth = [f"tooth_{t}" for t in range(1, self._most_teeth + 1)]
        return np.array([*teeth, "misfit", *OF_SEVERITY], dtype=object)

    def transform(self, X: pd.DataFrame) -> FloatArray:
        """Scores of rows.

        Parameters
        ----------
        X
            Rows with ``teeth``, ``speed_rpm`` (rpm), ``torque`` (N m), ``averages``, ``scatter`` (unit of the signal)
            and ``tsa``, the average from the tacho mark; or with ``template_scores`` that this has given before.

        Returns
        -------
        (rows, most teeth + 10) float64
            As ``get_feature_names_out``; -inf for teeth that a gear does not have.

        Raises
        ------
        InputError
            If a column is missing, an average has the wrong length or is not finite, a scatter is not above 0, or the
            bank does not have the tooth count.
        """
        if hasattr(X, "columns") and SCORED in X.columns and len(X):
            return as_matrix(X[SCORED])
        check_columns(X)
        point = X[["speed_rpm", "torque", "teeth"]].to_numpy(float)
        place = self.bank.nearest(*point.T)
        noise = X["scatter"].to_numpy(float) / np.sqrt(X["averages"].to_numpy(float))
        pieces = [
            (one, rows[first : first + _ROWS_AT_ONCE])
            for one in np.unique(place)
            for rows in [np.flatnonzero(place == one)]
            for first in range(0, len(rows), _ROWS_AT_ONCE)
        ]
        tsa = X["tsa"].to_numpy()
        found = Parallel(n_jobs=self.n_jobs, prefer="threads")(
            delayed(self._scores)(self.bank.points[one], tsa[rows], noise[rows]) for one, rows in pieces
        )
        scores = np.empty((len(X), self._most_teeth + 1 + len(OF_SEVERITY)))
        for (_, rows), some in zip(pieces, found, strict=True):
            scores[rows] = some
        return scores

    def _scores(self, point: PointTemplates, tsa: NDArray[Any], noise: FloatArray) -> FloatArray:
        x = _averages(tsa, point)
        laws = point.hypotheses
        likelihood = laws.log_likelihood(x, noise=noise, index_error=self.bank.index_error)
        known = posterior(likelihood, point.log_prior, point.healthy)
        ratio = np.full((len(x), self._most_teeth), -np.inf)
        ratio[:, : point.teeth] = known.location[:, 1:] - known.location[:, :1]
        misfit = _misfit(likelihood, point, noise, self.bank.index_error)
        return np.column_stack([ratio, misfit, *_severity(known, point.severity)])


def noise_at_point(bank: TemplateBank, X: pd.DataFrame) -> tuple[IntArray, FloatArray | None]:
    """Of rows, the place of the nearest operating point of a bank, and the noise relative to its healthy signal, dB."""
    point = bank.nearest(*X[["speed_rpm", "torque", "teeth"]].to_numpy(float).T)
    reference = np.array([one.reference_variance.mean() for one in bank.points])
    return point, noise_db(X, reference[point])


def check_columns(X: pd.DataFrame) -> None:
    """Refuse input that is not rows with averages and their scatter."""
    lacking = [name for name in COLUMNS if not hasattr(X, "columns") or name not in X.columns]
    if lacking:
        raise InputError(
            f"X lacks the columns {lacking}; give rows of Database.features() with tsa of Database.signals()"
        )
    if X.empty:
        raise InputError("X has no rows; give at least one")
    scatter = X["scatter"].to_numpy(float)
    if not (scatter > 0).all():
        raise InputError(
            f"scatter = {scatter[np.argmin(scatter > 0)]:g} must be above 0: the noise of an average is taken from the "
            "scatter between its revolutions; give averages of 2 revolutions or more"
        )


def _averages(tsa: NDArray[Any], point: PointTemplates) -> FloatArray:
    wrong = [np.size(one) for one in tsa if np.size(one) != point.samples]
    if wrong:
        raise InputError(
            f"tsa has {wrong[0]} samples, but the bank's averages of {point.teeth} teeth have {point.samples}; "
            "average with as many samples a tooth"
        )
    x = np.stack(list(tsa)).astype(float)
    if not np.isfinite(x).all():
        raise InputError("tsa holds values that are not finite; keep rows whose status is 'ok'")
    return x


def _misfit(likelihood: FloatArray, point: PointTemplates, noise: FloatArray, index_error: float) -> FloatArray:
    """(rows,) squared residual of the most likely hypothesis, whitened, over the number of samples."""
    n = point.samples
    d = (point.hypotheses.gains * (index_error / noise)[:, None, None]) ** 2
    constant = n * np.log(2 * np.pi * noise**2)[:, None] + np.log1p(d).sum(axis=2)
    square = -2 * likelihood - constant[:, :, None]
    best = likelihood.reshape(len(noise), -1).argmax(axis=1)
    return square.reshape(len(noise), -1)[np.arange(len(noise)), best] / n


def _severity(known: Posterior, level: FloatArray) -> list[FloatArray]:
    """Mean, median and spread of each severity; templates with a pattern have none, and do not take part."""
    plain: BoolArray = np.isfinite(level.sum(axis=1))
    given = Posterior(location=known.location, damage=np.where(plain, known.damage, -np.inf))
    if not np.isfinite(given.damage).any(axis=1).all():
        return [np.full(len(known.location), np.nan)] * len(OF_SEVERITY)
    levels = np.where(plain[:, None], level, 0.0).T
    mean = [given.mean(one) for one in levels]
    median = [given.median(one) for one in levels]
    square = [given.severity @ one**2 - m**2 for one, m in zip(levels, mean, strict=True)]
    return [*mean, *median, *(np.sqrt(one.clip(min=0)) for one in square)]
