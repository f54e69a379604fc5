"""Cells that coverage is conditional on: noise and operating point of a record, and the severity of its label."""

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.recognition.calibration.conformal import least_specimens
from sigdb.recognition.rows.batch import Batch

BAND_DB = 2.5
"""Width of a band of noise: in a trial a threshold of sets changed by less than its own error within it."""

_MOST_LEVELS = 12
"""Most levels of a severity; more values than these are merged into as many groups."""


def band_edges(noise: FloatArray, specimens: IntArray, coverage: float) -> FloatArray:
    """Return the edges between bands of noise, each :data:`BAND_DB` wide, or wider so that it has specimens enough.

    Noise is in dB; there are no edges where that of a row is not known (nan).
    """
    edges: list[float] = []
    if not np.isfinite(noise).all():
        return np.array(edges)
    needed = least_specimens(coverage)
    for edge in np.arange(noise.min() + BAND_DB, noise.max(), BAND_DB).tolist():
        last = edges[-1] if edges else -np.inf
        sides = (noise >= last) & (noise < edge), noise >= edge
        if all(len(np.unique(specimens[side])) >= needed for side in sides):
            edges.append(edge)
    return np.array(edges)


def bands(edges: FloatArray, noise: FloatArray) -> IntArray:
    """Return the band of each row, (rows,); the last one where noise is not known."""
    return np.searchsorted(edges, noise, side="right")


def band_thresholds(thresholds: FloatArray, edges: FloatArray, noise: FloatArray) -> FloatArray:
    """Return thresholds (bands, ...) by row, (rows, ...): those of its band, the greatest where noise is not known."""
    finite = np.isfinite(noise).reshape(-1, *[1] * (thresholds.ndim - 1))
    return np.where(finite, thresholds[bands(edges, noise)], thresholds.max(axis=0))


def levels_of(values: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the levels of a severity, ascending, and the place of each row's nearest among them; one more for nan."""
    finite = np.isfinite(values)
    levels = np.unique(values[finite])
    if len(levels) > _MOST_LEVELS:
        levels = np.unique(np.quantile(values[finite], np.linspace(0, 1, _MOST_LEVELS), method="nearest"))
    nearest = np.searchsorted((levels[1:] + levels[:-1]) / 2, values)
    return levels, np.where(finite, nearest, len(levels))


def cells_of(point: IntArray, severity: FloatArray) -> IntArray:
    """Return the number of each row's cell, (rows,): of its operating point (rows,) and severities (rows, k)."""
    return _numbers(np.column_stack([point, *(levels_of(values)[1] for values in severity.T)]))


def points_of(batch: Batch) -> IntArray:
    """Return the number of each row's tooth count, speed and torque, (rows,)."""
    return _numbers(np.column_stack(batch.operating_point()))


def _numbers(columns: FloatArray | IntArray) -> IntArray:
    return np.unique(columns, axis=0, return_inverse=True)[1].ravel()
