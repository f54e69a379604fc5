"""Difference of an average from a healthy one between the mesh harmonics, in units of its deviation."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import ifft
from scipy.special import gammaincinv

from sigdb.core import BoolArray, ComplexArray, FloatArray, IntArray
from sigdb.diagnosis.change.average_spectrum import AverageSpectrum

LOWEST_ORDER = 9
"""Lowest order of a difference: unbalance, run-out and couplings change the orders below it."""

USED = 0.9
"""Share of the range of orders of both recordings up to which they are compared."""

PLACES = 8
"""Places in a tooth pass at which statistics are evaluated."""

MODULATION = 1
"""Distance from a mesh harmonic, in orders, up to which a change is one of run-out or load once a revolution."""

_OTHERS = 4.0
"""Distance from the strongest place, in tooth passes, beyond which a difference is that of the other teeth; at most a
quarter of the turn."""

_FINE = 1024
"""Steps in a tooth pass of the search for the turn between two averages."""

_CANDIDATES = 8
"""Turns of each score whose residuals are compared."""

_NEAR = 0.02
"""Largest turn between two averages that begin at the same tacho mark, in tooth passes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Band:
    """Difference within half a mesh harmonic of one.

    Attributes
    ----------
    harmonic
        Mesh harmonic h.
    orders
        (K,) orders k within ``h Z - Z / 2 <= k < h Z + Z / 2``, without h Z and its neighbours.
    gain
        Complex gain g from the healthy average to the other one.
    residual
        (K,) difference divided by its deviation.
    deviation
        (K,) deviation of the difference.
    """

    harmonic: int
    orders: IntArray
    gain: complex
    residual: ComplexArray
    deviation: FloatArray

    @property
    def level(self) -> float:
        """Sum of the squares of the residual."""
        return float(np.sum(np.abs(self.residual) ** 2))


@dataclass(frozen=True, kw_only=True, eq=False)
class Change:
    """Change of an average since a healthy one, without the mesh harmonics.

    Attributes
    ----------
    teeth
        Tooth count Z.
    bands
        The difference, by mesh harmonic.
    turn
        Part of a revolution by which the healthy average was turned to fit the other.
    likeness
        Correlation of the two averages after turn and gains, from 0 to 1: what the errors of each tooth leave in both.
    """

    teeth: int
    bands: tuple[Band, ...]
    turn: float
    likeness: float

    @property
    def degrees(self) -> int:
        """Complex degrees of freedom: orders less gains."""
        return sum(len(band.orders) - 1 for band in self.bands)

    @property
    def misfit(self) -> float:
        """Mean square of the residual per degree of freedom: 1 where nothing but noise has changed."""
        return sum(band.level for band in self.bands) / max(self.degrees, 1)

    @cached_property
    def energy(self) -> FloatArray:
        """(8 Z,) energy of the residual's envelopes by place of the turn; its expectation is 1 for noise."""
        count = sum(len(band.orders) for band in self.bands)
        return np.asarray(envelopes(self, [band.residual for band in self.bands]).sum(axis=0) / count)

    @cached_property
    def others(self) -> BoolArray:
        """(8 Z,) places of the other teeth: more than four tooth passes from the strongest place."""
        size = PLACES * self.teeth
        off = np.abs((np.arange(size) - int(np.argmax(self.energy)) + size // 2) % size - size // 2)
        return np.asarray(off > PLACES * min(_OTHERS, self.teeth / 4))

    @property
    def middle(self) -> float:
        """Median energy of the other teeth relative to that of noise, at least 1; a damaged tooth does not raise it."""
        return max(1.0, self.raw_middle)

    @cached_property
    def raw_middle(self) -> float:
        """Median energy of the other teeth relative to that of noise, whose energy in B bands follows a gamma law."""
        B = len(self.bands)
        return float(np.median(self.energy[self.others]) / (gammaincinv(B, 0.5) / B))

    @property
    def tooth_map(self) -> FloatArray:
        """(Z,) mean energy of the residual in each tooth pass, relative to the median of the other teeth."""
        return np.asarray(self.energy.reshape(self.teeth, PLACES).mean(axis=1) / self.middle)


def orders_of_bands(teeth: int, samples: int, highest: float) -> list[tuple[int, IntArray]]:
    """Return the mesh harmonics below a highest order, with the orders about each but itself."""
    k = np.arange(samples // 2)
    far = np.minimum(k % teeth, -k % teeth) > MODULATION
    usable = far & (k >= LOWEST_ORDER) & (k < highest)
    bands = [
        (h, k[usable & (k >= h * teeth - teeth // 2) & (k < h * teeth + (teeth + 1) // 2)])
        for h in range(1, int(highest / teeth) + 1)
    ]
    return [(h, orders) for h, orders in bands if len(orders) > 2]


def highest_common(*spectra: AverageSpectrum) -> float:
    """Return the highest order up to which spectra are compared."""
    return USED * min(min(spectrum.highest_order, spectrum.samples / 2) for spectrum in spectra)


def turn_between(run: AverageSpectrum, healthy: AverageSpectrum, *, absolute: bool) -> float:
    """Return the turn of the healthy average at which it fits another one best, in revolutions.

    Averages that begin at the same mark are searched within 0.02 tooth pass, others over the whole revolution, in steps
    of 1/1024 tooth pass. With the spectra X and H, the inverse variances w, and the correlation
    ``C_b(u) = sum_k w_k X_k^* H_k exp(2 pi j k u)`` in each band b, candidates are the greatest values of ::

        sum_b |C_b(u)|^2 / sum_k w_k |H_k|^2    and    sum_b Re C_b(u) q_b(u) / sqrt(sum_k w_k |H_k|^2),

    with a gain that is free in each band, and with its phase q from the mesh harmonic. The candidate
    with the least median energy of the residual is taken: a damaged tooth hardly raises it, a wrong turn does.
    """
    Z, n = run.teeth, run.samples
    free, by_mesh = np.zeros(Z * _FINE), np.zeros(Z * _FINE)
    turns = np.arange(Z * _FINE) / (Z * _FINE)
    for h, k in orders_of_bands(Z, n, highest_common(run, healthy)):
        w = 1 / (run.variance[k] + healthy.variance[k])
        X, H = run.mean[k], healthy.mean[k]
        line = np.zeros(Z * _FINE, complex)
        line[k] = w * np.conj(X) * H
        cross, power = ifft(line) * len(line), np.sum(w * np.abs(H) ** 2)
        free += np.abs(cross) ** 2 / power
        mesh = np.conj(run.mean[h * Z]) * healthy.mean[h * Z]
        phase = np.exp(-1j * (np.angle(mesh) + 2 * np.pi * h * Z * turns))
        by_mesh += np.real(cross * phase) / np.sqrt(power)
    steps = (np.arange(len(free)) + len(free) // 2) % len(free) - len(free) // 2
    if absolute:
        free = np.where(np.abs(steps) <= _NEAR * _FINE, free, -np.inf)
        return float(steps[np.argmax(free)] / len(free))
    candidates = {int(i) for score in (free, by_mesh) for i in _peaks(score)}
    results = {i: change_from(run, healthy, turn=steps[i] / len(free)) for i in candidates}
    best = min(results, key=lambda i: results[i].raw_middle if results[i].bands else 0.0)
    return float(steps[best] / len(free))


def _peaks(score: FloatArray) -> list[int]:
    """Return the greatest values of a score over the turn, more than half a tooth pass apart."""
    rest = score.copy()
    results: list[int] = []
    for _ in range(_CANDIDATES):
        best = int(np.argmax(rest))
        results.append(best)
        rest[(best + np.arange(-_FINE // 2, _FINE // 2 + 1)) % len(rest)] = -np.inf
    return results


def change_from(run: AverageSpectrum, healthy: AverageSpectrum, *, turn: float) -> Change:
    """Return the change of an average since a healthy one.

    In each band about a mesh harmonic the healthy spectrum H, turned, is multiplied by the complex gain g that fits the
    spectrum X best. The residual is ``(X - g H) / s`` with ``s^2 = v_X + |g|^2 v_H`` and the variances v of both. So
    another load, another sensor and a path that changed smoothly leave little, and the errors of each tooth, which both
    averages hold, cancel.

    Parameters
    ----------
    run, healthy
        Spectra of two averages of the same length.
    turn
        Turn of the healthy average, from :func:`turn_between`.
    """
    healthy = healthy.turned(turn)
    X, H, vX, vH = run.mean, healthy.mean, run.variance, healthy.variance
    bands = []
    kept, total = 0.0, 0.0
    for h, k in orders_of_bands(run.teeth, run.samples, highest_common(run, healthy)):
        w = 1 / np.maximum(vX[k] + vH[k], np.finfo(float).tiny)
        power = float(np.sum(w * np.abs(H[k]) ** 2))
        gain = complex(np.sum(w * np.conj(H[k]) * X[k]) / power) if power > 0 else 0j
        deviation = np.sqrt(np.maximum(vX[k] + abs(gain) ** 2 * vH[k], np.finfo(float).tiny))
        residual = np.asarray((X[k] - gain * H[k]) / deviation, complex)
        bands.append(Band(harmonic=h, orders=k, gain=gain, residual=residual, deviation=deviation))
        kept += abs(gain) ** 2 * power
        total += float(np.sum(w * np.abs(X[k]) ** 2))
    likeness = float(np.sqrt(min(kept / total, 1.0))) if total > 0 else 0.0
    return Change(teeth=run.teeth, bands=tuple(bands), turn=turn, likeness=likeness)


def excess(change: Change, places: BoolArray) -> FloatArray:
    """Return the median energy (bands,) over places of the turn, relative to noise in one band, at least 1.

    The energy of noise in one band follows the exponential law, whose median is ln 2.
    """
    parts = [band.residual / np.sqrt(len(band.orders)) for band in change.bands]
    return np.asarray(np.maximum(1.0, np.median(envelopes(change, parts)[:, places], axis=1) / np.log(2)))


def amplitudes(change: Change, parts: Sequence[ComplexArray]) -> ComplexArray:
    """Return ``sum_k c_k exp(2 pi j (k - h Z) u)`` (bands, ..., 8 Z) of each band, by place u of the turn.

    Parameters
    ----------
    change
        Change whose bands are meant.
    parts
        Coefficients (..., K) of each band.
    """
    Z = change.teeth
    size = PLACES * Z
    results: list[ComplexArray] = []
    for band, c in zip(change.bands, parts, strict=True):
        line = np.zeros((*np.shape(c)[:-1], size), complex)
        line[..., (band.orders - band.harmonic * Z) % size] = c
        results.append(ifft(line, axis=-1) * size)
    return np.array(results)


def envelopes(change: Change, parts: Sequence[ComplexArray]) -> FloatArray:
    """Return the squared magnitudes of :func:`amplitudes`."""
    return np.asarray(np.abs(amplitudes(change, parts)) ** 2)
