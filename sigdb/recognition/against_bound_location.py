"""Location beside the Bayes rule: information used, decibels wasted, and how well probabilities come true."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray
from sigdb.recognition.answers import Answers
from sigdb.recognition.bayes_bound import Bound
from sigdb.recognition.bootstrap import UNKNOWN, Figure, Specimens, columns_of
from sigdb.recognition.efficiency import INFORMATION_RANGE
from sigdb.recognition.expected import error_curve_around
from sigdb.recognition.metrics_calibration import ENOUGH, calibration_error, calibration_values
from sigdb.recognition.rows_by_point import OperatingPoint


def of_location(
    answers: Answers, rows: pd.DataFrame, best: Bound, points: Sequence[OperatingPoint], draws: int
) -> dict[str, float]:
    """``error``, ``bound_error``, ``chance``, ``eta_info`` and ``loss_db`` of rows; see :func:`against_bound`."""
    specimens = Specimens(rows["specimen"])
    wrong = (np.asarray(answers.found) != rows["tooth"].to_numpy()).astype(float)
    best_wrong = best.losses.loc[rows.index, "error"].to_numpy()
    excess = specimens.mean(wrong - best_wrong)
    curve = error_curve_around(points, (excess.low, excess.high), draws=draws)
    value, low, high = curve.excess_db([excess.value, excess.low, excess.high]).tolist()
    return {"chance": curve.chance, "expected_error": curve.own} | columns_of(
        error=specimens.mean(wrong),
        bound_error=specimens.mean(best_wrong),
        excess=excess,
        eta_info=_eta_info(answers, rows, best, points, specimens),
        loss_db=Figure(value=value, low=low, high=high),
    )


def of_calibration(answers: Answers, rows: pd.DataFrame) -> dict[str, float]:
    """``ece`` of rows, mean probability of the answers (``confidence``) and share of them that is wrong."""
    if answers.probabilities is None:
        return columns_of(ece=UNKNOWN)
    p = answers.probabilities
    said = {
        "confidence": float(p.max(axis=1).mean()),
        "error_of_answers": float((p.argmax(axis=1) != rows["tooth"].to_numpy()).mean()),
    }
    return said | columns_of(
        ece=calibration_error(p, rows, Specimens(rows["specimen"])) if len(rows) >= ENOUGH else UNKNOWN
    )


def _eta_info(
    answers: Answers, rows: pd.DataFrame, best: Bound, points: Sequence[OperatingPoint], specimens: Specimens
) -> Figure:
    if answers.probabilities is None:
        return UNKNOWN
    prior = _prior_log_loss(points).loc[rows.index].to_numpy()
    bayes = best.losses.loc[rows.index, "log_loss"].to_numpy()
    model = calibration_values(answers.probabilities, rows)["log_loss"]
    low, high = INFORMATION_RANGE
    if not low * prior.mean() <= bayes.mean() <= high * prior.mean():
        return UNKNOWN
    return specimens.figure(lambda h, m, b: (h - m) / (h - b), prior, model, bayes)


def _prior_log_loss(points: Sequence[OperatingPoint]) -> "pd.Series[float]":
    """By id, log loss of what is known before an average is seen; its mean is the entropy H."""
    return pd.concat([pd.Series(_before(point), point.asked.rows.index) for point in points])


def _before(point: OperatingPoint) -> FloatArray:
    return -point.before.location[0, point.asked.rows["tooth"].to_numpy()]
