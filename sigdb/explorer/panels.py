"""Arrays of the panels of an average: the signal, its spectrum and its Wigner-Ville distribution."""

import numpy as np

from sigdb.core import FloatArray
from sigdb.signature import order_spectrum, wigner_ville

MESH_ORDERS = 4
"""Highest order that is shown, as a multiple of the tooth count."""
_MOST_SAMPLES, _LEAST_IN_TOOTH, _MOST_IN_TOOTH = 1024, 16, 32
"""Samples of the average of a distribution, and in a tooth pass of it; the highest mesh orders are left out."""
_COLUMNS = 256
"""Angles of a distribution at most."""


def average_panels(tsa: FloatArray, teeth: int, healthy: FloatArray | None = None) -> dict[str, FloatArray]:
    """Return the arrays that a page draws of an average.

    Parameters
    ----------
    tsa : ndarray, (n,)
        Average of one revolution.
    teeth : int
        Tooth count.
    healthy : ndarray, (n,), optional
        A healthy average behind it.

    Returns
    -------
    dict of arrays
        ``tsa``, ``spectrum`` (peak amplitudes of the orders from 0), ``wigner_ville`` (angles, bins) and ``orders``
        (bins,); ``tsa_healthy`` and ``spectrum_healthy`` with a healthy average.
    """
    highest = min(MESH_ORDERS * teeth, len(tsa) // 2)
    w, orders = _distribution(tsa - tsa.mean(), teeth, highest)
    arrays = {"tsa": tsa, "spectrum": _amplitudes(tsa, highest), "wigner_ville": w, "orders": orders}
    if healthy is not None:
        arrays |= {"tsa_healthy": healthy, "spectrum_healthy": _amplitudes(healthy, highest)}
    return arrays


def _amplitudes(tsa: FloatArray, highest: int) -> FloatArray:
    return np.asarray(np.abs(order_spectrum(tsa)[1][: highest + 1]))


def _distribution(x: FloatArray, teeth: int, highest: int) -> tuple[FloatArray, FloatArray]:
    """Return the distribution (angles, bins) to a highest order, and the order of each bin."""
    fewer = teeth * max(_LEAST_IN_TOOTH, min(_MOST_IN_TOOTH, _MOST_SAMPLES // teeth))
    if len(x) > fewer:
        x = np.fft.irfft(np.fft.rfft(x)[: fewer // 2 + 1], fewer) * fewer / len(x)
    w = wigner_ville(x)
    orders = np.arange(w.shape[1]) * len(x) / (2 * w.shape[1])
    shown = orders <= highest
    # Whole columns in a tooth pass, so that a turned average has turned columns.
    samples = len(x) // teeth
    step = next(
        step for step in range(1, samples + 1) if samples % step == 0 and len(x) // step <= max(_COLUMNS, teeth)
    )
    return w[::step, shown], orders[shown]
