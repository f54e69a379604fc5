"""Reasons why no template fits an average, with thresholds that few rows of the training exceed."""

from dataclasses import replace

import numpy as np

from sigdb.core import IntArray
from sigdb.recognition.answers import NO_TEMPLATE_FITS
from sigdb.recognition.calibration.conformal import COVERED, row_quantile
from sigdb.recognition.noise.surprise import surprise_text
from sigdb.recognition.rows.batch import Batch
from sigdb.recognition.templates.scores import TemplateScores

_COVERED = (1 + COVERED) / 2
"""Share of rows that are within each of two thresholds."""


def fit_thresholds(reducer: TemplateScores, batch: Batch, tooth: IntArray) -> tuple[float, float]:
    """Return the greatest reduced chi-square and the greatest surprise of rows that templates fit.

    One in 200 rows of the training exceeds the former. One in 200 healthy rows at most exceeds the latter, and one in
    200 damaged ones; a kind of fewer rows does not count. So one in a hundred rows fits no template.

    Parameters
    ----------
    reducer
        Reducer of averages to scores.
    batch
        Rows of the training, with their averages or their scores.
    tooth
        (rows,) their first damaged tooth, 0 for none.
    """
    batch = _reduced(reducer, batch)
    surprise, _ = reducer.surprise(batch)
    of_kinds = [row_quantile(surprise[kind], _COVERED) for kind in (tooth == 0, tooth > 0)]
    greatest = max((value for value in of_kinds if np.isfinite(value)), default=np.inf)
    return row_quantile(reducer.reduced_chi2(batch), _COVERED), greatest


def unfit_reasons(reducer: TemplateScores, batch: Batch, *, reduced_chi2: float, surprise: float) -> list[str]:
    """Return why no template fits a row, empty where one does, (rows,).

    Parameters
    ----------
    reducer, batch
        As for :func:`fit_thresholds`.
    reduced_chi2, surprise
        Thresholds of :func:`fit_thresholds`.
    """
    batch = _reduced(reducer, batch)
    strange = reducer.reduced_chi2(batch) > reduced_chi2
    values, places = reducer.surprise(batch)
    samples = {point.teeth: point.samples for point in reducer.bank.points}
    reasons = np.where(strange, NO_TEMPLATE_FITS, "").tolist()
    for i in np.flatnonzero(values > surprise).tolist():
        teeth = int(batch.column("teeth")[i])
        reasons[i] = f"{NO_TEMPLATE_FITS}: {surprise_text(places[i], samples[teeth], teeth)}"
    return reasons


def _reduced(reducer: TemplateScores, batch: Batch) -> Batch:
    """Return rows with their scores."""
    return replace(batch, reduced={**batch.reduced, reducer.column: batch.reduce(reducer)})
