"""How far a model is from the best possible answer, by noise band and over all rows."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from sigdb.recognition.against_bound_detection import of_detection
from sigdb.recognition.against_bound_location import of_calibration, of_location
from sigdb.recognition.against_bound_severity import of_severity
from sigdb.recognition.answers import Answers
from sigdb.recognition.bayes_bound import Bound
from sigdb.recognition.noise_bands import NoiseBand, noise_bands
from sigdb.recognition.rows_by_point import OperatingPoint
from sigdb.recognition.severity import TARGETS

DRAWS = 4000
"""Rows drawn for each level of a band's error curve."""


def against_bound(
    target: str,
    answers: Answers,
    rows: pd.DataFrame,
    best: Bound | None = None,
    points: Sequence[OperatingPoint] = (),
    *,
    draws: int = DRAWS,
) -> pd.DataFrame:
    """A model beside the Bayes rule on the same rows, those inside of the law that the rule knows.

    Each figure has the ends of its 95 % interval, a bootstrap over specimens, as ``NAME_low`` and ``NAME_high``; nan is
    what the rows do not tell.

    ==============================  ==================================================================================
    column                          of each band
    ==============================  ==================================================================================
    ``band``, ``low_db``,           signal-to-noise ratio of one revolution; ``all`` for all rows
    ``high_db``
    ``rows``, ``specimens``         how many
    ``error``, ``bound_error``,     location: share of wrong answers of model and Bayes rule, of the most frequent
    ``chance``                      answer; severity: mean absolute errors
    ``eta_info``                    location: :func:`eta_info`, with the log losses of the same rows
    ``loss_db``                     location: :meth:`ErrorCurve.excess_db` of the paired excess ``error - bound_error``
    ``a90``, ``bound_a90``,         location: of both at a false-alarm rate of 1e-3, and their quotient
    ``a90_ratio``, ``a90_95_ratio``
    ``ece``                         location: expected calibration error, of 20 000 rows or more
    ``target``, ``mae_ratio``,      severity: MAE over that of the posterior median, CRPS over that of the posterior
    ``crps_ratio``, ``rmse_ratio``  (both by the same quantiles), RMSE over that of the posterior mean
    ==============================  ==================================================================================

    Parameters
    ----------
    target
        ``location``, ``severity`` or ``detection``.
    answers
        Of the model.
    rows
        By id, as :func:`asked_rows` gives them.
    best
        The bound of these rows; without it only what needs none.
    points
        Operating points of the rows, for location; of them ``draws`` rows are drawn for each level of the noise.
    """
    if best is not None:
        inside = rows.index.isin(best.rows.index)
        answers, rows = answers.only(inside), rows[inside]
        best = replace(best, rows=best.rows.loc[rows.index], losses=best.losses.loc[rows.index])
    table = pd.DataFrame(
        [
            _head(band, rows) | one
            for band in noise_bands(rows["snr_db"])
            for one in _of_band(target, answers.only(band.inside), rows[band.inside], best, points, draws)
        ]
    )
    if "target" not in table:
        return table
    order = table["target"].map(TARGETS.index).sort_values(kind="stable").index
    return table.loc[order].reset_index(drop=True)


def _head(band: NoiseBand, rows: pd.DataFrame) -> dict[str, Any]:
    own = rows["specimen"][band.inside]
    return {
        "band": band.name,
        "low_db": band.low,
        "high_db": band.high,
        "rows": len(own),
        "specimens": own.nunique(),
    }


def _of_band(
    target: str,
    answers: Answers,
    rows: pd.DataFrame,
    best: Bound | None,
    points: Sequence[OperatingPoint],
    draws: int,
) -> list[dict[str, Any]]:
    if isinstance(answers.found, pd.DataFrame):
        return [] if best is None else of_severity(answers.found, rows, best)
    columns: dict[str, Any] = {} if best is None else dict(of_detection(answers, rows, best))
    if target == "location":
        columns |= of_calibration(answers, rows)
        columns |= {} if best is None else of_location(answers, rows, best, _asked(points, rows), draws)
    return [columns]


def _asked(points: Sequence[OperatingPoint], rows: pd.DataFrame) -> list[OperatingPoint]:
    """The points that have some of the rows, asked for them."""
    asked = [point.asking(rows.index) for point in points]
    return [point for point in asked if point.rows["judged"].any()]
