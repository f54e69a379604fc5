"""The order spectrum of a whole record over the angle of a shaft, and the lines that stand out in it."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sigdb.core import BoolArray, FloatArray
from sigdb.recording.orders import NamedOrder

_MOST = 1024
"""Revolutions, the first ones, that a spectrum is made of: a resolution of a thousandth of an order."""
_FALSE_ALARM = 1e-4
"""Probability that noise alone makes a named order stand out."""
_PEAKS = 20
"""Unnamed lines that are listed, those that stand out most."""
_ABOUT = 6.0
"""Orders from a mesh harmonic within which a line is named by its distance from it."""
_LOBE = 2
"""Half-width of a line behind a Hann window, in bins."""
_REFINED = 0.01
"""Orders by which an order may be missed."""
_SKIRT = 0.1
"""Orders about a line within which smaller ones are its skirts: the speed is never known exactly."""


@dataclass(frozen=True, kw_only=True)
class RecordSpectrum:
    """Order spectrum of whole revolutions, behind a Hann window.

    Attributes
    ----------
    order
        (bins,) a bin each 1/M of an order, M the revolutions.
    amplitude
        (bins,) peak amplitude of a line at the middle of a bin.
    level
        (bins,) median amplitude over the order about each bin, rounding at least.
    """

    order: FloatArray
    amplitude: FloatArray
    level: FloatArray
    _windowed: FloatArray
    """(revolutions, samples_per_rev) the record behind its window, which has a sum of 2."""

    @property
    def samples(self) -> int:
        """Samples of the record that it is made of."""
        return self._windowed.size

    def at(self, orders: FloatArray) -> FloatArray:
        """Peak amplitudes at orders, wherever they lie between bins."""
        revolutions, n = self._windowed.shape
        within = self._windowed @ np.exp(-2j * np.pi / n * np.outer(np.arange(n), orders))
        return np.abs(np.sum(within * np.exp(-2j * np.pi * np.outer(np.arange(revolutions), orders)), axis=0))


def record_spectrum(x: FloatArray, *, samples_per_rev: int, highest: float) -> RecordSpectrum:
    """Spectrum of a record that is sampled in equal steps of angle.

    Parameters
    ----------
    x
        (revolutions * samples_per_rev,) record.
    samples_per_rev
        Samples a revolution.
    highest
        Highest order.
    """
    x = x[: _MOST * samples_per_rev]
    window = np.hanning(len(x) + 1)[:-1]
    windowed = 2 * window / window.sum() * (x - x.mean())
    revolutions = len(x) // samples_per_rev
    bins = min(int(highest * revolutions), len(x) // 2) + 1
    amplitude = np.abs(np.fft.rfft(windowed)[:bins])
    return RecordSpectrum(
        order=np.arange(bins) / revolutions,
        amplitude=amplitude,
        level=np.maximum(_level(amplitude, revolutions), 64 * np.finfo(float).eps * np.max(np.abs(x))),
        _windowed=windowed.reshape(revolutions, samples_per_rev),
    )


def spectral_lines(spectrum: RecordSpectrum, orders: tuple[NamedOrder, ...], *, teeth: int) -> pd.DataFrame:
    """Named orders within a spectrum, and of the lines between whole orders without a name those that stand out most.

    An order is found where its amplitude is at least ``sqrt(log2(1/p))`` times the level about it: amplitudes of noise
    follow Rayleigh's law, which passes a times its median with probability ``2^(-a^2)``, and p is 1e-4 for a named
    order, that divided by the count of bins for one without a name. Where lines lie close together, the level holds
    lines too, and fewer are found.

    Returns
    -------
    pandas.DataFrame
        ``name``, ``kind``, ``order``, ``amplitude``, ``over_level`` (amplitude over level), ``found``; by order.
    """
    named = [one for one in orders if one.order <= spectrum.order[-1]]
    unnamed = _unnamed(spectrum, named, teeth)
    found = pd.DataFrame([vars(one) for one in (*named, *unnamed)], columns=["name", "kind", "order"])
    threshold = np.repeat([_threshold(1), _threshold(len(spectrum.order))], [len(named), len(unnamed)])
    found["amplitude"] = spectrum.at(found["order"].to_numpy(float))
    level = np.interp(found["order"], spectrum.order, spectrum.level)
    found["over_level"] = found["amplitude"] / np.maximum(level, np.finfo(float).tiny)
    found["found"] = found["over_level"] >= threshold
    return found.sort_values("order", ignore_index=True)


def _threshold(bins: int) -> float:
    return float(np.sqrt(np.log2(bins / _FALSE_ALARM)))


def _level(amplitude: FloatArray, revolutions: int) -> FloatArray:
    """Median over each half order, and that of its neighbours, between the middles of those stretches."""
    step = max(revolutions // 2, 1)
    starts = np.arange(0, len(amplitude), step)
    medians = [np.median(amplitude[max(start - step // 2, 0) : start + step + step // 2]) for start in starts]
    return np.interp(np.arange(len(amplitude)), starts + step / 2, medians)


def _unnamed(spectrum: RecordSpectrum, named: list[NamedOrder], teeth: int) -> list[NamedOrder]:
    """The most outstanding peaks between whole orders that no name explains."""
    from scipy.ndimage import maximum_filter1d

    A, bin_ = spectrum.amplitude, spectrum.order[1]
    reach = max(_LOBE, int(_SKIRT / bin_))
    peaks = np.flatnonzero(maximum_filter1d(A, 2 * reach + 1) == A)
    peaks = peaks[(A[peaks] >= _threshold(len(A)) * spectrum.level[peaks]) & (peaks > _LOBE) & (peaks < len(A) - 1)]
    peaks = peaks[~_explained(spectrum.order[peaks], named, max(_LOBE * bin_, _REFINED))]
    first = np.argsort(A[peaks] / np.maximum(spectrum.level[peaks], np.finfo(float).tiny))[::-1][:_PEAKS]
    meshes = [one for one in named if one.kind == "mesh" and one.order % teeth == 0]
    return [_by_distance(_refined(spectrum, int(peak)), meshes) for peak in peaks[first]]


def _explained(orders: FloatArray, named: list[NamedOrder], tolerance: float) -> BoolArray:
    """Whether an order is named, or a whole one: those are of the averaged shaft, and the average has them."""
    known: NDArray[np.float64] = np.array([one.order for one in named])
    whole = np.abs(orders - np.round(orders)) <= tolerance
    return np.asarray(whole | np.any(np.abs(orders[:, None] - known) <= tolerance, axis=1))


def _refined(spectrum: RecordSpectrum, peak: int) -> float:
    """Order of a peak between bins, by the parabola through the logarithms of three of them."""
    a, b, c = np.log(np.maximum(spectrum.amplitude[peak - 1 : peak + 2], np.finfo(float).tiny))
    return float((peak + (a - c) / (2 * (a - 2 * b + c))) * spectrum.order[1])


def _by_distance(order: float, meshes: list[NamedOrder]) -> NamedOrder:
    """A line by its distance from a harmonic of the averaged gear's mesh near it."""
    near = [one for one in meshes if abs(one.order - order) <= _ABOUT]
    nearest = min(near, key=lambda one: abs(one.order - order), default=None)
    name = f"order {order:.2f}" if nearest is None else f"{nearest.name} {order - nearest.order:+.2f}"
    return NamedOrder(name=name, kind="unnamed", order=order)


_LEAST_REVOLUTIONS = 24
"""Below them lines fill the spectrum between whole orders."""


def average_noise(x: FloatArray, *, samples_per_rev: int, scatter: float, highest: float) -> FloatArray:
    """Standard deviation of the noise of an average, at each order, as white noise of the density there has it.

    With L the level of the record's spectrum behind a Hann window, N its samples and M the revolutions of the average,
    noise of density s^2 has ``E |A|^2 = 6 s^2 / N`` and a median of ln 2 of that, so that ::

        s / sqrt(M) = L sqrt(N / (6 M ln 2)).

    Tones between whole orders, other shafts' and the slow changes of speed and load, which the scatter between
    revolutions holds, are lines and do not count. Fewer than 24 revolutions are too few to tell lines from noise: there
    the scatter is taken as noise that is white as far as the record reaches.

    Parameters
    ----------
    x
        (M * samples_per_rev,) record in equal steps of angle.
    samples_per_rev
        n.
    scatter
        Standard deviation between the revolutions.
    highest
        Highest order of the record.

    Returns
    -------
    numpy.ndarray
        (n / 2 + 1,), of orders 0, 1, ...
    """
    n = samples_per_rev
    M = len(x) // n
    if M < _LEAST_REVOLUTIONS:
        return np.full(n // 2 + 1, scatter / np.sqrt(M * min(1.0, highest / (n / 2))))
    spectrum = record_spectrum(x, samples_per_rev=n, highest=n / 2)
    level = np.interp(np.arange(n // 2 + 1), spectrum.order, spectrum.level)
    return np.asarray(level * np.sqrt(spectrum.samples / (6 * M * np.log(2))))
