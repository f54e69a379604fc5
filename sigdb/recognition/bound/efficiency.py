"""How far a model is from the best possible answer, by noise band and over all rows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from sigdb.core import BoolArray, FloatArray
from sigdb.recognition.answers import Answers
from sigdb.recognition.bound.bayes_bound import Bound
from sigdb.recognition.bound.error_curve import INFORMATION_RANGE
from sigdb.recognition.bound.expected_losses import error_curve_around
from sigdb.recognition.bound.operating_points import OperatingPoint
from sigdb.recognition.metrics.calibration import ENOUGH, calibration_error, calibration_values
from sigdb.recognition.metrics.estimate import UNKNOWN, Estimate, Specimens, columns_of, interval
from sigdb.recognition.metrics.location_and_severity import severity_values
from sigdb.recognition.metrics.probability_of_detection import Pod, detection_by_loss
from sigdb.recognition.severity_quantities import QUANTITIES

_COLUMNS = {"stiffness_loss", "phase_shift_deg"}


def detection_efficiency(answers: Answers, rows: pd.DataFrame, best: Bound) -> dict[str, float]:
    """a90 at a false-alarm rate of 1e-3 of model and bound, by the same fit on the same rows, and their quotients.

    Of a model whose a90 is beyond the losses of the rows while the bound's is not, the quotient is infinite.
    """
    if answers.detection is None or not set(rows) >= _COLUMNS:
        return {}
    model = detection_by_loss(np.asarray(answers.detection), rows)
    bound = detection_by_loss(best.rows.loc[rows.index, "log_odds"].to_numpy(), rows)
    if model is None or bound is None:
        return columns_of(a90=UNKNOWN, bound_a90=UNKNOWN, a90_ratio=UNKNOWN) | {"a90_95_ratio": np.nan}
    return columns_of(a90=model.a90, bound_a90=bound.a90, a90_ratio=_smallest_loss_ratio(model, bound)) | {
        "a90_95_ratio": model.a90_95.value / bound.a90_95.value
    }


def _smallest_loss_ratio(model: Pod, bound: Pod) -> Estimate:
    if np.isnan(model.a90.value) and not np.isnan(bound.a90.value):
        greatest = model.levels["found"].iloc[-1] < 0.9
        return Estimate(value=np.inf, low=np.nan, high=np.nan) if greatest else UNKNOWN
    return interval(model.resampled / bound.resampled)


def location_efficiency(
    answers: Answers, rows: pd.DataFrame, best: Bound, points: Sequence[OperatingPoint], draws: int
) -> dict[str, float]:
    """``error``, ``bound_error``, ``chance``, ``eta_info`` and ``loss_db`` of rows; see :func:`against_bound`."""
    specimens = Specimens(rows["specimen"])
    wrong = (np.asarray(answers.predicted) != rows["tooth"].to_numpy()).astype(float)
    best_wrong = best.losses.loc[rows.index, "error"].to_numpy()
    excess = specimens.mean(wrong - best_wrong)
    curve = error_curve_around(points, (excess.low, excess.high), draws=draws)
    value, low, high = curve.excess_db([excess.value, excess.low, excess.high]).tolist()
    return {"chance": curve.chance, "expected_error": curve.own} | columns_of(
        error=specimens.mean(wrong),
        bound_error=specimens.mean(best_wrong),
        excess=excess,
        eta_info=_eta_info(answers, rows, best, points, specimens),
        loss_db=Estimate(value=value, low=low, high=high),
    )


def calibration_efficiency(answers: Answers, rows: pd.DataFrame) -> dict[str, float]:
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
) -> Estimate:
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


def severity_efficiency(found: pd.DataFrame, rows: pd.DataFrame, best: Bound) -> list[dict[str, float | str]]:
    """A row for each target that varies; see :func:`against_bound`."""
    specimens = Specimens(rows["specimen"])
    known = best.rows.loc[rows.index]
    ours, bound = severity_values(found, rows), severity_values(posterior_answers(known), rows)
    return [
        {"target": target} | _beside(target, ours, bound, known[f"mean_{target}"].to_numpy(), rows, specimens)
        for target in QUANTITIES
        if rows[target].nunique() > 1
    ]


def posterior_answers(rows: pd.DataFrame) -> pd.DataFrame:
    """The posterior's median and interval of each target, as a model would answer.

    Scored by the same quantiles as a model, so that the two CRPS are of one kind.

    Parameters
    ----------
    rows
        :attr:`Bound.rows` of severity.
    """
    ends = {"": "median", "_low": "low", "_high": "high"}
    return pd.DataFrame(
        {f"{target}{end}": rows[f"{kind}_{target}"] for target in QUANTITIES for end, kind in ends.items()}
    )


def _beside(
    target: str,
    ours: dict[str, FloatArray],
    bound: dict[str, FloatArray],
    mean: FloatArray,
    rows: pd.DataFrame,
    specimens: Specimens,
) -> dict[str, float]:
    true = rows[target].to_numpy(float)
    error, best = ours[f"mae_{target}"], bound[f"mae_{target}"]
    return {"chance": float(np.abs(true - np.median(true)).mean())} | columns_of(
        error=specimens.mean(error),
        bound_error=specimens.mean(best),
        mae_ratio=_ratio(specimens, error, best),
        crps_ratio=_ratio(specimens, ours[f"crps_{target}"], bound[f"crps_{target}"]),
        rmse_ratio=specimens.figure(lambda a, b: np.sqrt(a / b), error**2, (mean - true) ** 2),
    )


def _ratio(specimens: Specimens, model: FloatArray, bound: FloatArray) -> Estimate:
    return specimens.figure(np.divide, model, bound)


WIDTH = 4.0
"""Width of a band, dB, nearly: as many of them as fit best between whole decibels."""

ALL = "all"
"""Name of the band that holds all rows."""


@dataclass(frozen=True, kw_only=True, eq=False)
class NoiseBand:
    """Rows of like noise.

    Attributes
    ----------
    name
        In words; :data:`ALL` for all rows.
    low, high
        Its ends, dB; nan where the rows have no signal-to-noise ratio.
    inside
        (rows,) which rows are in it.
    """

    name: str
    low: float
    high: float
    inside: BoolArray


def noise_bands(snr_db: pd.Series) -> list[NoiseBand]:
    """Bands that hold rows, from much noise to little, and at last all rows; of one signal-to-noise ratio only that.

    Examples
    --------
    >>> import pandas as pd
    >>> [band.name for band in noise_bands(pd.Series([-9.5, -7.0, -2.5]))]
    ['-10 to -6 dB', '-6 to -2 dB', 'all']
    """
    values = snr_db.to_numpy(float)
    every = np.full(len(values), True)
    if not np.isfinite(values).all() or np.ptp(values) == 0:
        one = float(values[0]) if np.isfinite(values).all() else np.nan
        return [NoiseBand(name=ALL, low=one, high=one, inside=every)]
    low, high = np.floor(values.min()), np.ceil(values.max())
    edges = np.linspace(low, high, max(1, round((high - low) / WIDTH)) + 1)
    place = np.clip(np.searchsorted(edges, values, side="right"), 1, len(edges) - 1)
    bands = [
        NoiseBand(name=f"{a:g} to {b:g} dB", low=a, high=b, inside=place == i)
        for i, (a, b) in enumerate(pairwise(edges.tolist()), start=1)
        if (place == i).any()
    ]
    return bands if len(bands) == 1 else [*bands, NoiseBand(name=ALL, low=float(low), high=float(high), inside=every)]


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
        answers, rows = answers.select(inside), rows[inside]
        best = replace(best, rows=best.rows.loc[rows.index], losses=best.losses.loc[rows.index])
    table = pd.DataFrame(
        [
            _head(band, rows) | one
            for band in noise_bands(rows["snr_db"])
            for one in _of_band(target, answers.select(band.inside), rows[band.inside], best, points, draws)
        ]
    )
    if "target" not in table:
        return table
    order = table["target"].map(QUANTITIES.index).sort_values(kind="stable").index
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
    if isinstance(answers.predicted, pd.DataFrame):
        return [] if best is None else severity_efficiency(answers.predicted, rows, best)
    columns: dict[str, Any] = {} if best is None else dict(detection_efficiency(answers, rows, best))
    if target == "location":
        columns |= calibration_efficiency(answers, rows)
        columns |= {} if best is None else location_efficiency(answers, rows, best, _asked(points, rows), draws)
    return [columns]


def _asked(points: Sequence[OperatingPoint], rows: pd.DataFrame) -> list[OperatingPoint]:
    """The points that have some of the rows, asked for them."""
    asked = [point.asking(rows.index) for point in points]
    return [point for point in asked if point.rows["judged"].any()]
