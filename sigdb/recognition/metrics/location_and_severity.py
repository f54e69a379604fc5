"""Metrics of location, of kinds of damage and of severity."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.database import SHOWN_QUANTITIES
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.metrics.metric import Kind, Metric


def crps_sample(values: ArrayLike, y: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """Compute the CRPS of a distribution that is a weighted sample.

    ``CRPS = E|X - y| - E|X - X'| / 2`` with X and X' drawn independently from the sample; in the unit of y, 0 at best.
    A sample of one value gives the absolute error.

    Parameters
    ----------
    values
        (..., k) sample.
    y
        (...) true values.
    weights
        (..., k) weights, of any positive sum; all equal if left out.

    Returns
    -------
    (...) float64

    References
    ----------
    Gneiting and Raftery, Strictly proper scoring rules, prediction, and estimation, J. Am. Stat. Assoc. 102 (2007),
    eq. 21, doi:10.1198/016214506000001437.

    Examples
    --------
    >>> float(crps_sample([0.0, 1.0], 0.0))
    0.25
    """
    x, y = np.asarray(values, float), np.asarray(y, float)
    w = np.ones(x.shape) if weights is None else np.broadcast_to(np.asarray(weights, float), x.shape)
    order = np.argsort(x, axis=-1)
    x, w = np.take_along_axis(x, order, axis=-1), np.take_along_axis(w, order, axis=-1)
    w = w / w.sum(axis=-1, keepdims=True)
    # The integral of F (1 - F), piece by piece between sorted values, is E|X - X'| / 2.
    F = np.cumsum(w, axis=-1)[..., :-1]
    spread = (F * (1 - F) * np.diff(x, axis=-1)).sum(axis=-1)
    return (w * np.abs(x - y[..., None])).sum(axis=-1) - spread


def crps_quantiles(quantiles: ArrayLike, levels: ArrayLike, y: ArrayLike) -> FloatArray:
    """Compute the CRPS of a distribution from some of its quantiles: twice the mean pinball loss.

    ``CRPS = 2 int_0^1 pinball_p(y - q_p) dp``, the integral taken as the mean over the levels: with the median and the
    ends of central intervals that is the weighted interval score, and of the median alone the absolute error.

    Parameters
    ----------
    quantiles
        (..., k) quantiles.
    levels
        (k,) their levels, between 0 and 1.
    y
        (...) true values.

    References
    ----------
    Bracher et al., Evaluating epidemic forecasts in an interval format, PLoS Comput. Biol. 17 (2021),
    doi:10.1371/journal.pcbi.1008618.

    Examples
    --------
    >>> float(crps_quantiles([2.0], [0.5], 5.0))
    3.0
    """
    p = np.asarray(levels, float)
    short = np.asarray(y, float)[..., None] - np.asarray(quantiles, float)
    return 2 * np.maximum(p * short, (p - 1) * short).mean(axis=-1)


def circular_distance(predicted: IntArray, true: IntArray, teeth: IntArray) -> IntArray:
    """Return the signed distance in teeth from the true to the predicted tooth, the short way around.

    Examples
    --------
    >>> import numpy as np
    >>> circular_distance(np.array([1, 12]), np.array([12, 1]), np.array([12, 12])).tolist()
    [1, -1]
    """
    half = teeth // 2
    return (predicted - true + half) % teeth - half


LOCATION_METRICS = (
    Metric(name="accuracy", title="P(correct), healthy too", better=1, bounded=True),
    Metric(name="p_exact", title="P(exact tooth)", better=1),
    Metric(name="p_within_one", title="P(within one)", better=1),
    Metric(name="p_detected", title="P(detected)", better=1),
    Metric(name="none_on_healthy", title="'none' on healthy", better=1),
    Metric(name="circular_bias", title="circular bias, teeth"),
)
"""Metrics of predicted teeth."""


def location_values(predicted: IntArray, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Return the value of each row by metric of location; NaN where a row does not count.

    Parameters
    ----------
    predicted
        (rows,) predicted tooth, 0 for none.
    rows
        ``tooth`` and ``teeth`` of each row.
    """
    true, teeth = rows["tooth"].to_numpy(int), rows["teeth"].to_numpy(int)
    damaged, called = true > 0, predicted > 0
    distance = circular_distance(predicted, true, teeth)
    return {
        "accuracy": (predicted == true).astype(float),
        "p_exact": np.where(damaged, predicted == true, np.nan),
        "p_within_one": np.where(damaged, called & (np.abs(distance) <= 1), np.nan),
        "p_detected": np.where(damaged, called, np.nan),
        "none_on_healthy": np.where(damaged, np.nan, ~called),
        "circular_bias": np.where(damaged & called, distance, np.nan),
    }


KIND_METRICS = (
    Metric(name="accuracy", title="P(correct), healthy too", better=1, bounded=True),
    Metric(name="p_kind", title="P(correct kind)", better=1),
    Metric(name="p_detected", title="P(detected)", better=1),
    Metric(name="none_on_healthy", title="'none' on healthy", better=1),
)
"""Metrics of predicted kinds of damage."""


def kind_values(correct: BoolArray, damaged: BoolArray, called: BoolArray) -> dict[str, FloatArray]:
    """Return the value of each row by metric of the kind; NaN where a row does not count.

    Parameters
    ----------
    correct
        (rows,) whether the predicted kind is the true one.
    damaged, called
        (rows,) whether the true and the predicted kind are damage.
    """
    return {
        "accuracy": correct.astype(float),
        "p_kind": np.where(damaged, correct, np.nan),
        "p_detected": np.where(damaged, called, np.nan),
        "none_on_healthy": np.where(damaged, np.nan, ~called),
    }


def _each(prefix: str, title: str, *, kind: Kind = Kind.MEAN, better: int = 0, bounded: bool = False) -> list[Metric]:
    """Return a metric of each quantity."""
    return [
        Metric(
            name=f"{prefix}_{quantity}",
            title=title.format(quantity) + (f", {shown.unit}" if shown.factor != 1 else ""),
            kind=kind,
            better=better,
            bounded=bounded,
            continuous=quantity != "damaged_teeth",
            factor=shown.factor,
        )
        for quantity, shown in SHOWN_QUANTITIES.items()
    ]


SEVERITY_METRICS = (
    *_each("mae", "MAE {}", better=-1, bounded=True),
    *_each("rmse", "RMSE {}", kind=Kind.ROOT_MEAN_SQUARE, better=-1, bounded=True),
    *_each("bias", "bias {}"),
    *_each("crps", "CRPS {}", better=-1, bounded=True),
    *(
        Metric(name=f"coverage_{quantity}", title=f"coverage of 90 % interval, {quantity}")
        for quantity in SHOWN_QUANTITIES
    ),
)
"""Metrics of predicted severities: mean absolute and root-mean-square error, bias, CRPS and coverage of intervals."""


def quantities_of(predicted: pd.DataFrame) -> tuple[str, ...]:
    """Return the quantities that predictions hold, in order."""
    return tuple(name for name in SHOWN_QUANTITIES if name in predicted)


def severity_errors(predicted: pd.DataFrame, rows: pd.DataFrame, quantity: str) -> FloatArray:
    """Return the estimate minus the truth (rows,) of a quantity."""
    return predicted[quantity].to_numpy(float) - rows[quantity].to_numpy(float)


def severity_values(predicted: pd.DataFrame, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Return the value of each row by metric of severity.

    The CRPS takes an estimate and the ends of its interval as median and quantiles (:func:`crps_quantiles`). Without an
    interval it is the absolute error.

    Parameters
    ----------
    predicted
        Estimates as :meth:`SeverityRegressor.predict` returns them.
    rows
        True severity of each row, nan where its damage does not have a quantity.
    """
    values: dict[str, FloatArray] = {}
    for quantity in quantities_of(predicted):
        error = severity_errors(predicted, rows, quantity)
        values |= {f"mae_{quantity}": np.abs(error), f"rmse_{quantity}": error, f"bias_{quantity}": error}
        values[f"crps_{quantity}"] = _crps(predicted, rows, quantity)
        if f"{quantity}_low" in predicted:
            values[f"coverage_{quantity}"] = interval_coverage(predicted, rows, quantity)
    return values


def interval_coverage(predicted: pd.DataFrame, rows: pd.DataFrame, quantity: str) -> FloatArray:
    """Return 1 for each row whose truth lies in the interval, its ends included, else 0; nan without a truth."""
    true = rows[quantity].to_numpy(float)
    low, high = (predicted[f"{quantity}_{end}"].to_numpy() for end in ("low", "high"))
    return np.where(np.isnan(true), np.nan, (low <= true) & (true <= high))


def _crps(predicted: pd.DataFrame, rows: pd.DataFrame, quantity: str) -> FloatArray:
    names, levels = [quantity], [0.5]
    if f"{quantity}_low" in predicted:
        names = [f"{quantity}_low", quantity, f"{quantity}_high"]
        levels = [(1 - COVERAGE) / 2, 0.5, (1 + COVERAGE) / 2]
    return crps_quantiles(predicted[names].to_numpy(float), levels, rows[quantity].to_numpy(float))
