"""The colour of noise: how its level differs from order to order, in octaves of the mesh order.

Noise that is stationary over the revolution is independent from order to order. So its colour is a deviation by order,
and the noise of an average is white once it is divided by that.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sigdb.core import FloatArray, InputError, IntArray, colour_stream
from sigdb.measurement.nuisance import NuisanceSettings


@lru_cache(16)
def order_bands(samples: int, teeth: int) -> IntArray:
    """Return the band of each order of an average, (samples / 2 + 1,).

    Bands end at half the mesh order, the mesh order, and its octaves.

    Examples
    --------
    >>> order_bands(16, 2).tolist()
    [0, 1, 2, 2, 3, 3, 3, 3, 3]
    """
    orders = samples // 2
    edges = teeth * 2.0 ** np.arange(-1, np.ceil(np.log2(orders / teeth)))
    return np.asarray(np.digitize(np.arange(orders + 1), edges))


def whole_mean(power: FloatArray) -> FloatArray:
    """Return the mean over the samples (...) of a power by order (..., orders); orders but the two ends count twice."""
    weights = np.full(power.shape[-1], 2.0)
    weights[[0, -1]] = 1.0
    return np.asarray(power @ weights / weights.sum())


def shape_of(levels: FloatArray | IntArray, samples: int, teeth: int) -> FloatArray:
    """Return the deviation by order (samples / 2 + 1,) of noise with levels (bands,), dB, relative to white noise.

    Between the middles of the bands it is a power of the order.
    """
    middle = np.log2(teeth) + np.arange(len(levels)) - 1.5
    place = np.log2(np.maximum(np.arange(samples // 2 + 1), 1))
    decibels = np.interp(place, middle, levels)
    last = place > middle[-1]
    slope = np.diff(levels)[-1] if len(levels) > 1 else 0
    decibels[last] += slope * (place[last] - middle[-1])
    return np.asarray(10 ** (decibels / 20))


def drawn_colours(settings: NuisanceSettings, seed: int, samples: int, teeth: int) -> FloatArray:
    """Return the colours that the noise of a machine may have, white first.

    The levels of the bands, dB, are normal with the covariance ``colour_db^2 exp(-(i - j)^2 / (2 colour_octaves^2))``.

    Parameters
    ----------
    settings
        Section ``[nuisance]``.
    seed
        Seed of the plan.
    samples, teeth
        Samples of an average, and its tooth count.

    Returns
    -------
    (1 + colours, samples / 2 + 1) float64
        Deviation of the noise by order over that of white noise of the same variance.

    Examples
    --------
    >>> settings = NuisanceSettings(colour_db=6.0, colours=3)
    >>> drawn_colours(settings, 1, 64, 4).shape, drawn_colours(settings, 1, 64, 4)[0].max().item()
    ((4, 33), 1.0)
    """
    bands = np.arange(int(order_bands(samples, teeth).max()) + 1)
    alike = np.exp(-(np.subtract.outer(bands, bands) ** 2) / (2 * settings.colour_octaves**2))
    variance, vectors = np.linalg.eigh(alike)
    root = vectors * np.sqrt(variance.clip(min=0))
    levels = colour_stream(seed).standard_normal((settings.colours, len(bands))) @ root.T * settings.colour_db
    shapes = np.stack([np.ones(samples // 2 + 1), *(shape_of(each, samples, teeth) for each in levels)])
    return np.asarray(shapes / np.sqrt(whole_mean(shapes**2))[:, None])


def coloured(white: FloatArray, shape: FloatArray) -> FloatArray:
    """Return white noise (..., n) multiplied by a deviation at each order, (..., n / 2 + 1)."""
    return np.asarray(np.fft.irfft(np.fft.rfft(white, axis=-1) * shape, white.shape[-1], axis=-1))


def measured_noise(
    stream: np.random.Generator, deviation: FloatArray, averages: IntArray | NDArray[np.float64]
) -> FloatArray:
    """Draw the noise by order that revolutions show: its standard deviation in one revolution.

    An order is a complex number in each revolution, so that its square is chi-square of ``2 (averages - 1)`` degrees of
    freedom; the two ends are real.

    Parameters
    ----------
    stream
        Random stream.
    deviation
        (..., orders) true deviation.
    averages
        Revolutions of each average, two or more, broadcast to the shape of the deviation.
    """
    parts = np.full(deviation.shape[-1], 2.0)
    parts[[0, -1]] = 1.0
    freedom: FloatArray = np.broadcast_to(parts * (np.asarray(averages, float) - 1), deviation.shape)
    return np.asarray(deviation * np.sqrt(stream.chisquare(freedom) / freedom))


def check_revolutions(settings: NuisanceSettings, averages: FloatArray) -> None:
    """Refuse averages of a single revolution where noise is coloured: they do not show its colour.

    Raises
    ------
    InputError
        If there are any.
    """
    if settings.colour_db and len(averages) and averages.min() < 2:
        raise InputError(
            f"averages = {averages.min():g} shows no scatter between revolutions, and nuisance.colour_db = "
            f"{settings.colour_db:g} dB is known from it; set averages to 2 or more, or leave the colour out"
        )
