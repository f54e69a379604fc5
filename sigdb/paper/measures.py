"""Measures of a signal of one revolution, tooth pass by tooth pass, for the paper's claims."""

import numpy as np

from sigdb.core import FloatArray
from sigdb.signature import demodulate, order_spectrum, wigner_ville

_NEAR = 0.5
"""Half-width of an order in the distribution: one bin to either side."""
_RIDGE = 2.0
"""Half-width of the ridge at a mesh harmonic, in orders: the main lobe of a lag window of 60 deg to either side."""


def by_pass(values: FloatArray, teeth: int) -> FloatArray:
    """Return (teeth, n / teeth, ...) values along a revolution, a row for each tooth pass."""
    return values.reshape(teeth, -1, *values.shape[1:])


def amplitudes(tsa: FloatArray, teeth: int) -> FloatArray:
    """Return (teeth,) amplitudes of each tooth pass: half of its peak-to-peak."""
    return np.ptp(by_pass(tsa, teeth), axis=1) / 2


def changes(tsa: FloatArray, healthy: FloatArray, teeth: int) -> FloatArray:
    """Return (teeth,) rms of the difference from the healthy signal in each pass, relative to the healthy rms."""
    return np.sqrt((by_pass(tsa - healthy, teeth) ** 2).mean(axis=1)) / healthy.std()


def modulations(tsa: FloatArray, teeth: int) -> tuple[FloatArray, FloatArray]:
    """Return the modulations of amplitude, relative to its mean, and of phase, in degrees of mesh phase, (n,) each."""
    amplitude, phase = demodulate(tsa, teeth=teeth)
    return amplitude, np.rad2deg(phase)


def departures(modulation: FloatArray, teeth: int, tooth: int) -> tuple[float, float]:
    """Return the greatest departures of a modulation from its median, up and down, within a tooth's pass."""
    departure = by_pass(modulation - np.median(modulation), teeth)[tooth - 1]
    return float(departure.max()), float(-departure.min())


def rise(modulation: FloatArray, teeth: int, tooth: int) -> float:
    """Return the greatest departure of a modulation from its median within a tooth's pass, with its sign."""
    up, down = departures(modulation, teeth, tooth)
    return up if up >= down else -down


def rises(tsa: FloatArray, teeth: int, tooth: int) -> tuple[float, float]:
    """Return the rises of amplitude, relative to its mean, and of phase, in degrees of mesh phase, in a pass."""
    amplitude, phase = modulations(tsa, teeth)
    return rise(amplitude, teeth, tooth), rise(phase, teeth, tooth)


def highest(tsa: FloatArray, teeth: int, tooth: int) -> float:
    """Return the greatest amplitude modulation within a tooth's pass, above its median."""
    amplitude, _ = demodulate(tsa, teeth=teeth)
    return float(by_pass(amplitude - np.median(amplitude), teeth)[tooth - 1].max())


def line(tsa: FloatArray, order: int) -> float:
    """Return the amplitude of an order."""
    return float(np.abs(order_spectrum(tsa)[1][order]))


def sidebands(tsa: FloatArray, teeth: int) -> float:
    """Return the sum of the amplitudes of the orders about the mesh order, half way to the next harmonic."""
    reach = (teeth - 1) // 2
    c = np.abs(order_spectrum(tsa)[1])
    return float(c[teeth - reach : teeth + reach + 1].sum() - c[teeth])


def below_mesh(tsa: FloatArray, teeth: int) -> float:
    """Return the amplitude of a sine with the power of all orders from 1 to below the mesh order."""
    return float(np.sqrt((np.abs(order_spectrum(tsa)[1][1:teeth]) ** 2).sum()))


def distribution(tsa: FloatArray) -> FloatArray:
    """Return the (n, n) Wigner-Ville distribution less the mean, half-window 60 deg; bin k is order k / 2."""
    return wigner_ville(tsa - tsa.mean(), lag_window=len(tsa) // 6)


def along(W: FloatArray, order: float) -> FloatArray:
    """Return the (n,) distribution at an order: the mean over the bins within half an order."""
    orders = np.arange(W.shape[1]) / 2
    return W[:, np.abs(orders - order) <= _NEAR].mean(axis=1)


def ridge(W: FloatArray, teeth: int) -> float:
    """Return the level of the ridge at the mesh order: its median over the revolution."""
    return float(np.median(along(W, teeth)))


def continuity(W: FloatArray, teeth: int) -> float:
    """Return the least value of the mesh order's ridge, relative to its level."""
    return float(along(W, teeth).min() / ridge(W, teeth))


def component(W: FloatArray, order: float, teeth: int, passes: tuple[int, ...]) -> tuple[float, float]:
    """Return the mean at an order over some passes and the mean magnitude over the others, relative to the ridge."""
    here = np.isin(np.arange(1, teeth + 1), passes)
    cells = by_pass(along(W, order), teeth)
    return float(cells[here].mean() / ridge(W, teeth)), float(np.abs(cells[~here]).mean() / ridge(W, teeth))


def arms(W: FloatArray, teeth: int) -> FloatArray:
    """Return (teeth,) mean magnitudes in each pass above and below the mesh order's ridge, relative to the ridge.

    They reach from the first ridge down to order 2 and up to the ridge of the second harmonic.
    """
    away = np.abs(np.arange(W.shape[1]) / 2 - teeth)
    between = (away > _RIDGE) & (away < teeth - _RIDGE)
    return np.asarray(np.abs(by_pass(W[:, between], teeth)).mean(axis=(1, 2)) / ridge(W, teeth))


def least_amplitude(tsa: FloatArray, teeth: int, centre_deg: float, reach_deg: float) -> tuple[float, float]:
    """Return the least amplitude of a window as long as a pass, centred near an angle, and the angle of its centre."""
    n = len(tsa)
    width = n // teeth
    first = np.arange(n)[:, None] - width // 2 + np.arange(width)
    amplitude = np.ptp(tsa[first % n], axis=1) / 2
    angle = np.arange(n) * 360 / n
    near = np.flatnonzero(np.abs(angle - centre_deg) <= reach_deg)
    least = near[amplitude[near].argmin()]
    return float(amplitude[least]), float(angle[least])
