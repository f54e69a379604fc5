"""Figures of merit of answers, with intervals from a bootstrap over specimens."""

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.calibration.conformal import COVERAGE
from sigdb.recognition.metrics.detection import called_figures, called_values
from sigdb.recognition.metrics.estimate import Estimate, Specimens
from sigdb.recognition.severity_quantities import QUANTITIES


def crps_sample(values: ArrayLike, y: ArrayLike, weights: ArrayLike | None = None) -> FloatArray:
    """CRPS of a distribution that is a weighted sample.

    ``CRPS = E|X - y| - E|X - X'| / 2`` with X and X' drawn independently from the sample; in the unit of y, 0 at best.
    A sample of one value gives the absolute error.

    Parameters
    ----------
    values
        (..., k) sample.
    y
        (...) what came true.
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
    """CRPS of a distribution of which some quantiles are known: twice the mean pinball loss.

    ``CRPS = 2 int_0^1 pinball_p(y - q_p) dp``, the integral taken as the mean over the levels: with the median and the
    ends of central intervals that is the weighted interval score, and of the median alone the absolute error.

    Parameters
    ----------
    quantiles
        (..., k) quantiles.
    levels
        (k,) their levels, between 0 and 1.
    y
        (...) what came true.

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


def circular_distance(found: IntArray, true: IntArray, teeth: IntArray) -> IntArray:
    """Signed distance in teeth from the true to the found tooth, the short way around.

    Examples
    --------
    >>> import numpy as np
    >>> circular_distance(np.array([1, 12]), np.array([12, 1]), np.array([12, 12])).tolist()
    [1, -1]
    """
    half = teeth // 2
    return (found - true + half) % teeth - half


def location_values(found: IntArray, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Of each row, what the figures of location are means of; nan where a row does not count."""
    true, teeth = rows["tooth"].to_numpy(int), rows["teeth"].to_numpy(int)
    damaged, called = true > 0, found > 0
    distance = circular_distance(found, true, teeth)
    return {
        "accuracy": (found == true).astype(float),
        "p_exact": np.where(damaged, found == true, np.nan),
        "p_within_one": np.where(damaged, called & (np.abs(distance) <= 1), np.nan),
        "p_detected": np.where(damaged, called, np.nan),
        "none_on_healthy": np.where(damaged, np.nan, ~called),
        "circular_bias": np.where(damaged & called, distance, np.nan),
    }


def location_figures(found: IntArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """P(correct), of damaged rows P(exact), P(within one tooth), P(detected), circular bias; 'none' on healthy ones.

    Parameters
    ----------
    found
        (rows,) tooth found, 0 for none.
    rows
        ``tooth``, ``teeth`` and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    specimens = Specimens(rows["specimen"], seed=seed)
    return {name: specimens.mean(value) for name, value in location_values(found, rows).items()}


def severity_errors(found: pd.DataFrame, rows: pd.DataFrame, target: str) -> FloatArray:
    """(rows,) estimate minus truth of a target."""
    return found[target].to_numpy(float) - rows[target].to_numpy(float)


def severity_values(found: pd.DataFrame, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Of each row, what the figures of severity are means of (root mean squares: ``rmse_`` holds the errors)."""
    values: dict[str, FloatArray] = {}
    for target in QUANTITIES:
        error = severity_errors(found, rows, target)
        values |= {f"mae_{target}": np.abs(error), f"rmse_{target}": error, f"bias_{target}": error}
        values[f"crps_{target}"] = _crps(found, rows, target)
        if f"{target}_low" in found:
            values[f"coverage_{target}"] = covered(found, rows, target)
    return values


def severity_figures(found: pd.DataFrame, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Estimate]:
    """Of each target: mean absolute and root-mean-square error, bias, CRPS, and the coverage of its interval.

    The CRPS takes an estimate and the ends of its interval as median and quantiles (:func:`crps_quantiles`); of an
    estimate without interval it is the absolute error.

    Parameters
    ----------
    found
        Estimates as :meth:`SeverityRegressor.predict` returns them.
    rows
        True targets and ``specimen`` of each row.
    seed
        Seed of the bootstrap.
    """
    specimens = Specimens(rows["specimen"], seed=seed)
    return {
        name: specimens.root_mean_square(value) if name.startswith("rmse") else specimens.mean(value)
        for name, value in severity_values(found, rows).items()
    }


def covered(found: pd.DataFrame, rows: pd.DataFrame, target: str) -> FloatArray:
    """(rows,) 1 where the truth lies in the interval, its ends included, else 0."""
    true = rows[target].to_numpy(float)
    return ((found[f"{target}_low"].to_numpy() <= true) & (true <= found[f"{target}_high"].to_numpy())).astype(float)


def _crps(found: pd.DataFrame, rows: pd.DataFrame, target: str) -> FloatArray:
    names, levels = [target], [0.5]
    if f"{target}_low" in found:
        names, levels = [f"{target}_low", target, f"{target}_high"], [(1 - COVERAGE) / 2, 0.5, (1 + COVERAGE) / 2]
    return crps_quantiles(found[names].to_numpy(float), levels, rows[target].to_numpy(float))


FIGURES: dict[str, Callable[..., dict[str, Estimate]]] = {
    "location": location_figures,
    "severity": severity_figures,
    "detection": called_figures,
}
"""Figures of merit by target."""

VALUES: dict[str, Callable[..., dict[str, FloatArray]]] = {
    "location": location_values,
    "severity": severity_values,
    "detection": called_values,
}
"""What they are means of, by target: for paired differences."""
