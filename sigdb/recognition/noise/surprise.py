"""Surprise: how uneven the residual of the most likely hypothesis is, and where.

Under the true hypothesis ``x ~ N(s, S)`` the whitened residual ``e = S^(-1/2) (x - s)`` is white noise of variance 1.
Then the energies of its orders are independent and chi-square distributed, in bands of orders as at each single one.
A ghost order, wear or lost pulses leave more in some of them than chance does.
"""

import numpy as np
import scipy.fft
from scipy.special import chdtrc, log_ndtr
from scipy.stats import chi2

from sigdb.core import FloatArray
from sigdb.measurement import order_bands
from sigdb.recognition.noise.noise_shape import band_orders

ANOTHER_TOOTH, MORE_DAMAGE = -1.0, -2.0
"""Places of a surprise that is no band of orders: as of damage at another tooth, and of more damage."""

_ORDERS = 1000.0
"""Place of order 0; bands are counted from 0."""

_NATS = np.log(10.0)


def surprise(e: FloatArray, teeth: int, uneven: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the surprise of whitened residuals and its place, (rows,) each.

    The surprise is ``-log10 p``. p is the least probability that chance leaves as much energy in a band of orders, or
    at a single one, times the number of bands, or of orders.

    Parameters
    ----------
    e
        (rows, samples) whitened residuals. In single precision the surprise has a relative error of 1e-5.
    teeth
        Tooth count.
    uneven
        (rows, bands) variance of the residuals in each band, where the noise is known to differ from white noise; see
        :class:`~sigdb.recognition.noise.noise_shape.RowNoise`.
    """
    samples = e.shape[1]
    bands = order_bands(samples, teeth)
    count = bands.max() + 1
    energy = (2 / samples) * np.abs(scipy.fft.rfft(e, axis=1)[:, 1:-1]) ** 2
    if uneven.shape[1] >= count:
        energy /= uneven[:, bands[1:-1]].astype(e.dtype)
    each = np.eye(count, dtype=e.dtype)[bands[1:-1]]
    orders = each.sum(axis=0)
    present = np.flatnonzero(orders)
    of_bands = _chi2_surprise(energy @ each[:, present], 2 * orders[present]) - np.log(len(present))
    of_orders = energy / 2 - np.log(energy.shape[1])
    rows = np.arange(len(e))
    band, order = of_bands.argmax(axis=1), of_orders.argmax(axis=1)
    of_band, of_order = of_bands[rows, band], of_orders[rows, order]
    place = np.where(of_band >= of_order, present[band], _ORDERS + 1 + order)
    return np.maximum(of_band, of_order) / _NATS, place


def _chi2_surprise(energy: FloatArray, freedom: FloatArray) -> FloatArray:
    """Return ``-log p`` of chi-square numbers, (rows, bands); SciPy's own logarithm is five times as slow."""
    p = chdtrc(freedom, energy.astype(float))
    with np.errstate(divide="ignore"):
        surprise = np.asarray(-np.log(p))
    rows, band = np.nonzero(p < np.finfo(float).tiny)
    surprise[rows, band] = -chi2.logsf(energy[rows, band].astype(float), freedom[band])
    return surprise


def normal_surprise(score: FloatArray, tests: int) -> FloatArray:
    """Return the surprise of the greatest of some standard normal numbers."""
    return np.asarray((-log_ndtr(-score) - np.log(tests)) / _NATS)


def surprise_text(place: float, samples: int, teeth: int) -> str:
    """Return the place of a surprise in words.

    Examples
    --------
    >>> surprise_text(2.0, 768, 12), surprise_text(1027.0, 768, 12)
    ('its residual stands out in orders 12 to 23', 'its residual stands out at order 27')
    """
    if place == ANOTHER_TOOTH:
        return "its residual shows damage at another tooth"
    if place == MORE_DAMAGE:
        return "its residual shows more damage than templates have"
    if place >= _ORDERS:
        return f"its residual stands out at order {place - _ORDERS:g}"
    low, high = band_orders(samples, teeth)[int(place)]
    return f"its residual stands out in orders {low} to {high}"
