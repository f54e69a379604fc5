"""The floor: what a healthy recording alone tells, without any simulation. A diagnosis must be at least as good.

The spectra of two averages over a turn are compared order by order between the mesh harmonics. In the band about each
harmonic the healthy one is multiplied by the complex gain that fits best, and the difference is divided by its
deviation. A short pulse of any shape is then looked for at each place of the turn. Where the difference is larger than
noise everywhere, as with another load or a moved sensor, the statistic is divided by its median over the turn.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import median_filter

from sigdb.core import ComplexArray, FloatArray

STEPS = 32
"""Samples of an average in a tooth pass."""
GROUP = 8
"""Revolutions in a group, between which the scatter is taken."""
LOWEST, USED = 9, 0.85
"""Lowest order, and the share of the orders below half the sampling rate up to which averages are compared."""
LAG = 0.9
"""Place of the pulse of a damaged tooth, in tooth passes after its first contact; usual for spur gears."""
FINE = 512
"""Steps in a tooth pass of the search for the turn between averages without a common mark."""
NEAR = 0.02
"""Turn between averages with a common mark, at most, in tooth passes."""


@dataclass(frozen=True, kw_only=True)
class MeanTurn:
    """Spectrum of the average over a turn.

    Attributes
    ----------
    spectrum, variance
        (n / 2 + 1,) spectrum, and the variance of its estimate.
    teeth, highest
        Tooth count, and highest order that is used.
    """

    spectrum: ComplexArray
    variance: FloatArray
    teeth: int
    highest: float

    @classmethod
    def of(cls, x: FloatArray, angle: FloatArray, *, teeth: int) -> Self:
        """Return that of a record ``x`` with the angle of each sample in tooth passes; it begins at a whole turn."""
        n, passes = STEPS * teeth, np.arange(len(x))
        first, last = int(np.ceil(angle[0] / teeth)), int(np.floor(angle[-1] / teeth))
        sample = np.interp(teeth * (first + np.arange((last - first) * n) / n), angle, passes)
        turns = CubicSpline(passes, x)(sample).reshape(-1, n)
        whole = len(turns) // GROUP * GROUP
        groups = np.fft.rfft(turns[:whole].reshape(-1, GROUP, n).mean(axis=1), axis=1)
        variance = groups.var(axis=0, ddof=1) / len(groups)
        nyquist = len(x) / (angle[-1] - angle[0]) * teeth / 2
        floor = median_filter(variance, 9, mode="nearest")
        return cls(
            spectrum=groups.mean(axis=0), variance=np.maximum(variance, floor), teeth=teeth, highest=USED * nyquist
        )

    def bands(self) -> list[np.ndarray]:
        """Return the orders about each mesh harmonic but the harmonic itself."""
        k, Z = np.arange(min(len(self.spectrum), int(self.highest) + 1)), self.teeth
        bands = [
            k[(np.abs(k - h * Z) <= (Z - 1) // 2) & (k % Z > 0) & (k >= LOWEST)] for h in range(1, len(k) // Z + 1)
        ]
        return [band for band in bands if len(band) > Z // 2]


def pulse(run: MeanTurn, healthy: MeanTurn, *, marked: bool) -> tuple[float, float]:
    """Return the greatest pulse statistic of a run, and its tooth's place in tooth passes from 0.

    ``marked`` says that both averages begin at the same mark.
    """
    Z, n = run.teeth, STEPS * run.teeth
    k, bands = np.arange(len(run.spectrum)), run.bands()
    H = healthy.spectrum * np.exp(2j * np.pi * k * _turn(run, healthy, bands, marked) / Z)
    white, shapes = np.zeros(n, complex), np.zeros((3, n))
    for band in bands:
        w = 1 / (run.variance + healthy.variance)[band]
        gain = (w * np.conj(H[band]) * run.spectrum[band]).sum() / (w * np.abs(H[band]) ** 2).sum()
        scale = np.sqrt(run.variance[band] + abs(gain) ** 2 * healthy.variance[band])
        white[band] = (run.spectrum[band] - gain * H[band]) / scale
        off = (band - np.round(band / Z) * Z) * np.pi / Z
        shapes[:, band] = np.exp(-0.5 * (off * np.array([[0.4], [0.8], [1.6]])) ** 2) / scale
    energy = np.abs(np.fft.ifft(white) * n) ** 2 / sum(map(len, bands))
    found = np.zeros((3, n))
    for band in bands:
        part = np.zeros((3, n), complex)
        part[:, band] = shapes[:, band] * white[band]
        found += np.abs(np.fft.ifft(part, axis=1) * n) ** 2 / (shapes[:, band] ** 2).sum(axis=1, keepdims=True)
    statistic = found.max(axis=0) / max(1.0, float(np.median(energy)) / np.log(2))
    return float(statistic.max()), float((statistic.argmax() / STEPS - LAG) % Z)


def _turn(run: MeanTurn, healthy: MeanTurn, bands: list[np.ndarray], marked: bool) -> float:
    """Return the turn of the healthy average that fits best, in tooth passes."""
    size = FINE * run.teeth
    fit = np.zeros(size)
    for band in bands:
        w = 1 / (run.variance + healthy.variance)[band]
        line = np.zeros(size, complex)
        line[band] = w * run.spectrum[band] * np.conj(healthy.spectrum[band])
        fit += np.abs(np.fft.fft(line)) ** 2 / (w * np.abs(healthy.spectrum[band]) ** 2).sum()
    turn = (np.arange(size) / FINE + run.teeth / 2) % run.teeth - run.teeth / 2
    return float(turn[np.argmax(np.where(np.abs(turn) <= NEAR, fit, -1) if marked else fit)])
