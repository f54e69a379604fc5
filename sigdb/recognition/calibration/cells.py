"""What coverage is conditional on: the noise and operating point of a record, and the severity that its label has."""

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.calibration.conformal import least_specimens

BAND_DB = 2.5
"""Width of a band of noise: in a trial a threshold of sets changed by less than its own error within it."""

_MOST_LEVELS = 12
"""Levels of a severity; more of them are taken together in as many groups."""


def noise_db(X: pd.DataFrame, reference: ArrayLike = 1.0) -> FloatArray | None:
    """(rows,) level of the noise of averages, re-estimated from the scatter between their revolutions.

    ``10 log10(scatter^2 / (averages reference))``, with a variance for reference, such as that of the healthy clean
    average. Its standard error is ``10 / ln 10 sqrt(2 / (n (m - 1)))`` dB, 0.02 dB for n = 768 samples and m = 102
    revolutions: as good as known.

    Returns
    -------
    ndarray or None
        None where the rows do not tell: columns ``scatter`` or ``averages`` are missing, or a scatter is not above 0.
    """
    if not {"scatter", "averages"} <= set(X.columns):
        return None
    scatter, averages = (X[name].to_numpy(float) for name in ("scatter", "averages"))
    if not (scatter > 0).all():
        return None
    return np.asarray(10 * np.log10(scatter**2 / (averages * np.asarray(reference, float))))


def band_edges(noise: FloatArray | None, specimens: IntArray, coverage: float) -> FloatArray:
    """Edges between bands of noise, each :data:`BAND_DB` wide, or wider so that it has specimens enough.

    There are none where noise is not known.
    """
    edges: list[float] = []
    if noise is None:
        return np.array(edges)
    needed = least_specimens(coverage)
    for edge in np.arange(noise.min() + BAND_DB, noise.max(), BAND_DB).tolist():
        last = edges[-1] if edges else -np.inf
        sides = (noise >= last) & (noise < edge), noise >= edge
        if all(len(np.unique(specimens[side])) >= needed for side in sides):
            edges.append(edge)
    return np.array(edges)


def bands(edges: FloatArray, noise: FloatArray | None, rows: int) -> IntArray:
    """(rows,) band of each row, the first one where noise is not known."""
    return np.zeros(rows, int) if noise is None else np.searchsorted(edges, noise, side="right")


def of_bands(thresholds: FloatArray, edges: FloatArray, noise: FloatArray | None, rows: int) -> FloatArray:
    """(rows, ...) thresholds (bands, ...) of each row's band; the greatest of all where its noise is not known."""
    if noise is None:
        return np.broadcast_to(thresholds.max(axis=0), (rows, *thresholds.shape[1:]))
    return np.asarray(thresholds[bands(edges, noise, rows)])


def levels_of(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Levels of a severity, ascending, and the place of each row's nearest among them; one more for nan."""
    known = np.isfinite(values)
    levels = np.unique(values[known])
    if len(levels) > _MOST_LEVELS:
        levels = np.unique(np.quantile(values[known], np.linspace(0, 1, _MOST_LEVELS), method="nearest"))
    nearest = np.searchsorted((levels[1:] + levels[:-1]) / 2, values)
    return levels, np.where(known, nearest, len(levels))


def cells_of(point: IntArray, severity: FloatArray) -> IntArray:
    """(rows,) number of each row's cell: its operating point (rows,) and its severities (rows, k) together."""
    return _numbers(np.column_stack([point, *(levels_of(one)[1] for one in severity.T)]))


def points_of(X: pd.DataFrame) -> IntArray:
    """(rows,) number of each row's tooth count, speed and torque."""
    return _numbers(X[["teeth", "speed_rpm", "torque"]].to_numpy(float))


def _numbers(columns: FloatArray | IntArray) -> IntArray:
    return np.unique(columns, axis=0, return_inverse=True)[1].ravel()
