"""Order spectrum of a whole record over the angle of a shaft, and the lines that stand out in it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sigdb.core import BoolArray, FloatArray, IntArray
from sigdb.recording.orders import NamedOrder

_MOST = 1024
"""Largest number of revolutions of a spectrum: a resolution of a thousandth of an order."""
_WINDOWS = 512
"""Number of windows whose medians are computed together."""
_FALSE_ALARM = 1e-4
"""Probability that noise alone makes a named order stand out."""
_PEAKS = 20
"""Largest number of unnamed lines in the list."""
_ABOUT = 6.0
"""Distance from a mesh harmonic, in orders, within which a line is named by that distance."""
_LOBE = 2
"""Half-width of a line under a Hann window, in bins."""
_FEW = 64
"""Revolutions below which all are taken: their transform is short."""
_REFINED = 0.01
"""Tolerance of an order."""
_SKIRT = 0.1
"""Distance from a line, in orders, within which smaller lines are its skirts: the speed is never known exactly."""


@dataclass(frozen=True, kw_only=True)
class RecordSpectrum:
    """Order spectrum of whole revolutions under a Hann window.

    Attributes
    ----------
    order
        (bins,) orders, 1/M apart for M revolutions.
    amplitude
        (bins,) peak amplitude of a line at the centre of each bin.
    level
        (bins,) median amplitude over the order about each bin, at least the rounding error.
    """

    order: FloatArray
    amplitude: FloatArray
    level: FloatArray
    _windowed: FloatArray
    """(revolutions, samples_per_rev) the record times its window, which has a sum of 2."""

    @property
    def samples(self) -> int:
        """Number of samples of the record."""
        return self._windowed.size

    def at(self, orders: FloatArray) -> FloatArray:
        """Return the peak amplitudes at orders, also between bins."""
        revolutions, n = self._windowed.shape
        within = self._windowed @ np.exp(-2j * np.pi / n * np.outer(np.arange(n), orders))
        return np.abs(np.sum(within * np.exp(-2j * np.pi * np.outer(np.arange(revolutions), orders)), axis=0))


@lru_cache(maxsize=2)
def hann_window(samples: int) -> FloatArray:
    """Return the periodic Hann window, whose sum is half its length; do not change it."""
    return np.asarray(np.hanning(samples + 1)[:-1])


def fast_revolutions(revolutions: int) -> int:
    """Return the number of first revolutions whose spectrum is computed: at most 6 % fewer, without a large factor.

    The time of a transform grows with the greatest prime factor of its length, which is above 11 for most numbers.

    Examples
    --------
    >>> fast_revolutions(499), fast_revolutions(500), fast_revolutions(61)
    (495, 500, 61)
    """
    from scipy.fft import prev_fast_len

    return revolutions if revolutions < _FEW else int(prev_fast_len(revolutions))


def hann_power(x: FloatArray) -> FloatArray:
    """Return the squared magnitudes of the spectrum of a record without its mean under a Hann window.

    It is computed in single precision, whose rounding is noise more than 130 dB below the record.
    """
    from scipy.fft import rfft

    apart: NDArray[np.float32] = np.empty(len(x), np.float32)
    np.subtract(x, x.mean(), out=apart, casting="same_kind")
    apart *= _single_hann_window(len(x))
    X = rfft(apart)
    return np.asarray(X.real**2 + X.imag**2, float)


@lru_cache(maxsize=2)
def _single_hann_window(samples: int) -> NDArray[np.float32]:
    return hann_window(samples).astype(np.float32)


def record_spectrum(x: FloatArray, *, samples_per_rev: int, highest: float) -> RecordSpectrum:
    """Return the spectrum of a record that is sampled in equal steps of angle.

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
    window = hann_window(len(x))
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
    """Return the named orders within a spectrum, and the unnamed lines between whole orders that stand out most.

    An order stands out where its amplitude is at least ``sqrt(log2(1/p))`` times the level about it. Amplitudes of
    noise follow Rayleigh's law, which exceeds a times its median with probability ``2^(-a^2)``. The probability p is
    1e-4 for a named order, and 1e-4 over the number of bins for a line without a name. Where lines lie close together,
    the level holds lines too, and fewer stand out.

    Parameters
    ----------
    spectrum
        Spectrum of the record.
    orders
        Named orders.
    teeth
        Tooth count of the averaged gear.

    Returns
    -------
    pandas.DataFrame
        ``name``, ``kind``, ``order``, ``amplitude``, ``over_level`` (amplitude over level), ``stands_out``; by order.
    """
    named = [order for order in orders if order.order <= spectrum.order[-1]]
    unnamed = _unnamed(spectrum, named, teeth)
    lines = pd.DataFrame([vars(order) for order in (*named, *unnamed)], columns=["name", "kind", "order"])
    threshold = np.repeat([_threshold(1), _threshold(len(spectrum.order))], [len(named), len(unnamed)])
    lines["amplitude"] = spectrum.at(lines["order"].to_numpy(float))
    level = np.interp(lines["order"], spectrum.order, spectrum.level)
    lines["over_level"] = lines["amplitude"] / np.maximum(level, np.finfo(float).tiny)
    lines["stands_out"] = lines["over_level"] >= threshold
    return lines.sort_values("order", ignore_index=True)


def _threshold(bins: int) -> float:
    return float(np.sqrt(np.log2(bins / _FALSE_ALARM)))


def _level(amplitude: FloatArray, revolutions: int, bins: IntArray | None = None) -> FloatArray:
    """Return medians over half orders and their neighbours, interpolated to some bins, or to all."""
    step = max(revolutions // 2, 1)
    starts = np.arange(0, len(amplitude), step)
    half = step // 2
    medians = np.empty(len(starts))
    inside = (starts >= half) & (starts + step + half <= len(amplitude))
    if inside.any():
        windows = sliding_window_view(amplitude, step + 2 * half)
        low, high = (step + 2 * half - 1) // 2, (step + 2 * half) // 2
        for some in np.array_split(np.flatnonzero(inside), max(1, inside.sum() // _WINDOWS)):
            parts = windows[starts[some] - half]  # a copy
            parts.partition(low, axis=1)
            greater = parts[:, low] if low == high else parts[:, high:].min(axis=1)
            medians[some] = (parts[:, low] + greater) / 2
    for i in np.flatnonzero(~inside):
        medians[i] = np.median(amplitude[max(starts[i] - half, 0) : starts[i] + step + half])
    return np.interp(np.arange(len(amplitude)) if bins is None else bins, starts + step / 2, medians)


def _unnamed(spectrum: RecordSpectrum, named: list[NamedOrder], teeth: int) -> list[NamedOrder]:
    """Return the most outstanding peaks between whole orders that no name explains."""
    from scipy.ndimage import maximum_filter1d

    A, bin_ = spectrum.amplitude, spectrum.order[1]
    reach = max(_LOBE, int(_SKIRT / bin_))
    peaks = np.flatnonzero(maximum_filter1d(A, 2 * reach + 1) == A)
    peaks = peaks[A[peaks] > 0]
    peaks = peaks[(A[peaks] >= _threshold(len(A)) * spectrum.level[peaks]) & (peaks > _LOBE) & (peaks < len(A) - 1)]
    peaks = peaks[~_explained(spectrum.order[peaks], named, max(_LOBE * bin_, _REFINED))]
    first = np.argsort(A[peaks] / np.maximum(spectrum.level[peaks], np.finfo(float).tiny))[::-1][:_PEAKS]
    meshes = [order for order in named if order.kind == "mesh" and order.order % teeth == 0]
    return [_by_distance(_refined(spectrum, int(peak)), meshes) for peak in peaks[first]]


def _explained(orders: FloatArray, named: list[NamedOrder], tolerance: float) -> BoolArray:
    """Return whether each order is named or whole: the average holds the whole orders."""
    named_orders: NDArray[np.float64] = np.array([order.order for order in named])
    whole = np.abs(orders - np.round(orders)) <= tolerance
    return np.asarray(whole | np.any(np.abs(orders[:, None] - named_orders) <= tolerance, axis=1))


def _refined(spectrum: RecordSpectrum, peak: int) -> float:
    """Return the order of a peak between bins by a parabola through the logarithms of three bins."""
    a, b, c = np.log(np.maximum(spectrum.amplitude[peak - 1 : peak + 2], np.finfo(float).tiny))
    return float((peak + (a - c) / (2 * (a - 2 * b + c))) * spectrum.order[1])


def _by_distance(order: float, meshes: list[NamedOrder]) -> NamedOrder:
    """Return a line named by its distance from a near harmonic of the averaged gear's mesh."""
    near = [mesh for mesh in meshes if abs(mesh.order - order) <= _ABOUT]
    nearest = min(near, key=lambda mesh: abs(mesh.order - order), default=None)
    name = f"order {order:.2f}" if nearest is None else f"{nearest.name} {order - nearest.order:+.2f}"
    return NamedOrder(name=name, kind="unnamed", order=order)


_LEAST_REVOLUTIONS = 24
"""Number of revolutions below which lines fill the spectrum between whole orders."""


def average_noise(
    x: FloatArray,
    *,
    samples_per_rev: int,
    scatter: float,
    highest: float,
    averages: int | None = None,
    power: FloatArray | None = None,
) -> FloatArray:
    """Return the standard deviation of the noise of an average for white noise of the density at each order.

    Let L be the level of the record's spectrum under a Hann window, N its samples and M the revolutions of the average.
    Noise of density s^2 has ``E |A|^2 = 6 s^2 / N``, and the median is ln 2 times that, so that ::

        s / sqrt(M) = L sqrt(N / (6 M ln 2)).

    Tones of other shafts and slow changes of speed and load, which the scatter between revolutions contains, are lines
    and do not count as noise. Fewer than 24 revolutions are too few to separate lines from noise: then the scatter is
    taken as noise that is white up to the highest order of the record.

    Parameters
    ----------
    x
        (K * samples_per_rev,) record in equal steps of angle.
    samples_per_rev
        Samples n in a revolution.
    scatter
        Standard deviation between the revolutions.
    highest
        Highest order of the record.
    averages
        Revolutions M of the average; K if left out.
    power
        :func:`hann_power` of the record, where it is known.

    Returns
    -------
    numpy.ndarray
        (n / 2 + 1,) deviations at orders 0, 1, ...
    """
    n = samples_per_rev
    M = len(x) // n if averages is None else averages
    if M < _LEAST_REVOLUTIONS:
        return np.full(n // 2 + 1, scatter / np.sqrt(M * min(1.0, highest / (n / 2))))
    K = fast_revolutions(min(len(x) // n, _MOST))
    x = x[: K * n]
    power = hann_power(x) if power is None or len(power) != len(x) // 2 + 1 else power
    largest = float(power.max()) or 1.0
    amplitude: NDArray[np.float32] = np.empty(power.shape, np.float32)  # medians of half the bytes, rounded to 6e-8
    np.sqrt(np.divide(power, largest, out=amplitude, casting="same_kind"), out=amplitude)
    level = _level(amplitude, K, np.arange(n // 2 + 1) * K) * np.sqrt(largest)
    level *= 4 / len(x)  # the window's sum is half the samples
    level = np.maximum(level, 64 * np.finfo(float).eps * np.max(np.abs(x)))
    return np.asarray(level * np.sqrt(len(x) / (6 * M * np.log(2))))
