"""Figures of merit of answers, with intervals from a bootstrap over specimens."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from sigdb.core.typing import FloatArray, IntArray
from sigdb.recognition.bootstrap import Figure, Specimens
from sigdb.recognition.conformal import COVERAGE
from sigdb.recognition.crps import crps_quantiles
from sigdb.recognition.metrics_detection import called_figures, called_values
from sigdb.recognition.severity import TARGETS


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


def location_figures(found: IntArray, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Figure]:
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
    for target in TARGETS:
        error = severity_errors(found, rows, target)
        values |= {f"mae_{target}": np.abs(error), f"rmse_{target}": error, f"bias_{target}": error}
        values[f"crps_{target}"] = _crps(found, rows, target)
        if f"{target}_low" in found:
            values[f"coverage_{target}"] = covered(found, rows, target)
    return values


def severity_figures(found: pd.DataFrame, rows: pd.DataFrame, *, seed: int = 0) -> dict[str, Figure]:
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


FIGURES: dict[str, Callable[..., dict[str, Figure]]] = {
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
