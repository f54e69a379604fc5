"""The shape of noise: how its level differs from order to order, in octaves of the mesh order.

Noise that is stationary over the revolution is independent from order to order. Averages, templates and modes that are
divided by its deviation, order by order, have white noise, and turning by a tooth stays exact.
"""

from collections.abc import Mapping

import numpy as np

from sigdb.core import FloatArray, IntArray
from sigdb.measurement import order_bands, shape_of, whole_mean

_LEAST_LEVEL = -40
"""Least level of a band, dB: above its Nyquist frequency a record has no noise."""


def band_orders(samples: int, teeth: int) -> list[tuple[int, int]]:
    """Return the least and the greatest order of each band."""
    bands = order_bands(samples, teeth)
    return [(int(at[0]), int(at[-1])) for at in (np.flatnonzero(bands == band) for band in range(bands.max() + 1))]


def band_means(power: FloatArray, teeth: int) -> FloatArray:
    """Return the means (rows, bands) of a power by order, (rows, samples / 2 + 1)."""
    bands = order_bands(2 * (power.shape[1] - 1), teeth)
    each = np.eye(bands.max() + 1)[bands]
    return np.asarray(power @ (each / each.sum(axis=0)))


def noise_levels(deviation: FloatArray, teeth: int) -> IntArray:
    """Return the level of noise in each band over that of all orders, in whole dB, (rows, bands).

    So rows of one noise share their levels although each estimates it anew. White noise has zeros.

    Parameters
    ----------
    deviation
        (rows, samples / 2 + 1) standard deviation of white noise with the density of the row's noise at each order.
    teeth
        Tooth count.
    """
    power = np.asarray(deviation, float) ** 2
    with np.errstate(divide="ignore"):
        level = 10 * np.log10(band_means(power, teeth) / whole_mean(power)[:, None])
    return np.asarray(np.round(np.maximum(level, _LEAST_LEVEL)).astype(int))


def whitened(x: FloatArray, shape: FloatArray) -> FloatArray:
    """Return averages (..., samples) divided by a deviation by order."""
    return np.asarray(np.fft.irfft(np.fft.rfft(x, axis=-1) / shape, x.shape[-1], axis=-1))


class RowNoise:
    """The noise of some rows: its shape, and its level behind that shape.

    Parameters
    ----------
    white
        (rows,) standard deviation of the noise of each average over all orders.
    by_teeth
        By tooth count, the places of its rows and their deviations by order, (rows, samples / 2 + 1); empty for white
        noise.

    Attributes
    ----------
    level
        (rows,) standard deviation of the noise of each average, once it is divided by its shape.
    levels
        (rows, bands) of :func:`noise_levels`; zeros for white noise.
    uneven
        (rows, bands) power of the noise in each band over that of its shape and level, about 1.
    """

    def __init__(self, white: FloatArray, by_teeth: Mapping[int, tuple[IntArray, FloatArray]]) -> None:
        by_teeth = {teeth: noise for teeth, noise in by_teeth.items() if noise[1].shape[1] > 1}
        bands = max(
            (order_bands(2 * (d.shape[1] - 1), teeth).max() + 1 for teeth, (_, d) in by_teeth.items()), default=1
        )
        self.level = white.copy()
        self.levels = np.zeros((len(white), bands), int)
        self.uneven = np.ones((len(white), bands))
        for teeth, (at, deviation) in by_teeth.items():
            self._set(teeth, at, deviation)

    def _set(self, teeth: int, at: IntArray, deviation: FloatArray) -> None:
        """Take the noise of rows by order, where it has a level."""
        stated = np.isfinite(deviation).all(axis=1) & (deviation > 0).any(axis=1)
        at, deviation = at[stated], deviation[stated]
        levels = noise_levels(deviation, teeth)
        width = levels.shape[1]
        self.levels[at, :width] = levels
        for some, places in self.alike(at):
            if not some.any():
                continue
            power = np.asarray(deviation[places], float) ** 2
            power /= shape_of(some[:width], 2 * (power.shape[1] - 1), teeth) ** 2
            mean = whole_mean(power)
            self.level[at[places]] = np.sqrt(mean)
            self.uneven[at[places], :width] = band_means(power, teeth) / mean[:, None]

    def alike(self, at: IntArray) -> list[tuple[IntArray, IntArray]]:
        """Return the different levels of rows at some places, with the places among these that have them."""
        different, number = np.unique(self.levels[at], axis=0, return_inverse=True)
        return [(levels, np.flatnonzero(number.ravel() == i)) for i, levels in enumerate(different)]
