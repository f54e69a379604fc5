"""What is read off a signal of one revolution, pass by pass: the quantities that the paper's claims are about."""

import numpy as np

from sigdb.core import FloatArray
from sigdb.signature import demodulate, order_spectrum, wigner_ville

_NEAR = 0.5
"""Half-width of an order in the distribution: one bin to either side."""
_RIDGE = 2.0
"""Half-width of the ridge at a mesh harmonic, in orders: the main lobe of a lag window of 60 deg to either side."""


def by_pass(values: FloatArray, teeth: int) -> FloatArray:
    """(teeth, n / teeth, ...) values along a revolution, a row for each tooth pass."""
    return values.reshape(teeth, -1, *values.shape[1:])


def amplitudes(tsa: FloatArray, teeth: int) -> FloatArray:
    """(teeth,) amplitude of each tooth pass: half of its peak-to-peak."""
    return np.ptp(by_pass(tsa, teeth), axis=1) / 2


def changes(tsa: FloatArray, healthy: FloatArray, teeth: int) -> FloatArray:
    """(teeth,) rms of the difference to the healthy signal in each pass, as a fraction of the healthy signal's rms."""
    return np.sqrt((by_pass(tsa - healthy, teeth) ** 2).mean(axis=1)) / healthy.std()


def rise(modulation: FloatArray, teeth: int, tooth: int) -> float:
    """Greatest departure of a modulation from its median over the revolution within a tooth's pass, with its sign."""
    departure = by_pass(modulation - np.median(modulation), teeth)[tooth - 1]
    return float(departure[np.abs(departure).argmax()])


def rises(tsa: FloatArray, teeth: int, tooth: int) -> tuple[float, float]:
    """The rise at a tooth's pass of amplitude, as a fraction of its mean, and of phase, in degrees of mesh phase."""
    amplitude, phase = demodulate(tsa, teeth=teeth)
    return rise(amplitude, teeth, tooth), float(np.rad2deg(rise(phase, teeth, tooth)))


def highest(tsa: FloatArray, teeth: int, tooth: int) -> float:
    """Greatest amplitude modulation within a tooth's pass, over its median."""
    amplitude, _ = demodulate(tsa, teeth=teeth)
    return float(by_pass(amplitude - np.median(amplitude), teeth)[tooth - 1].max())


def line(tsa: FloatArray, order: int) -> float:
    """Amplitude of one order."""
    return float(np.abs(order_spectrum(tsa)[1][order]))


def sidebands(tsa: FloatArray, teeth: int) -> float:
    """Sum of the amplitudes of the orders about the mesh order, to half of the way to the next harmonic."""
    reach = (teeth - 1) // 2
    c = np.abs(order_spectrum(tsa)[1])
    return float(c[teeth - reach : teeth + reach + 1].sum() - c[teeth])


def below_mesh(tsa: FloatArray, teeth: int) -> float:
    """Amplitude of a sine with the power of all orders from 1 to below the mesh order."""
    return float(np.sqrt((np.abs(order_spectrum(tsa)[1][1:teeth]) ** 2).sum()))


def distribution(tsa: FloatArray) -> FloatArray:
    """(n, n) Wigner-Ville distribution of a signal less its mean, half-window 60 deg; bin k is order k / 2."""
    return wigner_ville(tsa - tsa.mean(), lag_window=len(tsa) // 6)


def along(W: FloatArray, order: float) -> FloatArray:
    """(n,) distribution along the revolution at an order: the mean over the bins within half an order of it."""
    orders = np.arange(W.shape[1]) / 2
    return W[:, np.abs(orders - order) <= _NEAR].mean(axis=1)


def ridge(W: FloatArray, teeth: int) -> float:
    """Level of the ridge at the mesh order: its median over the revolution."""
    return float(np.median(along(W, teeth)))


def continuity(W: FloatArray, teeth: int) -> float:
    """Least of the mesh order's ridge over the revolution, as a fraction of its level."""
    return float(along(W, teeth).min() / ridge(W, teeth))


def component(W: FloatArray, order: float, teeth: int, passes: tuple[int, ...]) -> tuple[float, float]:
    """Mean at an order over some tooth passes, and mean magnitude over all others, as fractions of the ridge."""
    here = np.isin(np.arange(1, teeth + 1), passes)
    cells = by_pass(along(W, order), teeth)
    return float(cells[here].mean() / ridge(W, teeth)), float(np.abs(cells[~here]).mean() / ridge(W, teeth))


def arms(W: FloatArray, teeth: int) -> FloatArray:
    """(teeth,) mean magnitude in each pass above and below the mesh order's ridge, as a fraction of the ridge.

    From the first ridge down to order 2 and up to the ridge of the second harmonic.
    """
    away = np.abs(np.arange(W.shape[1]) / 2 - teeth)
    beside = (away > _RIDGE) & (away < teeth - _RIDGE)
    return np.asarray(np.abs(by_pass(W[:, beside], teeth)).mean(axis=(1, 2)) / ridge(W, teeth))


def least_amplitude(tsa: FloatArray, teeth: int, centre_deg: float, reach_deg: float) -> tuple[float, float]:
    """Least amplitude of a stretch as long as a pass, centred within so many degrees of an angle, and that angle."""
    n = len(tsa)
    width = n // teeth
    first = np.arange(n)[:, None] - width // 2 + np.arange(width)
    amplitude = np.ptp(tsa[first % n], axis=1) / 2
    angle = np.arange(n) * 360 / n
    near = np.flatnonzero(np.abs(angle - centre_deg) <= reach_deg)
    least = near[amplitude[near].argmin()]
    return float(amplitude[least]), float(angle[least])
