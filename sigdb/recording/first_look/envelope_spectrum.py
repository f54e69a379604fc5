"""Envelope spectrum of a record over the angle of a shaft, with the orders of bearings and shafts."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from sigdb.core import ComplexArray, FloatArray, InputError
from sigdb.recording.orders import NamedOrder

HIGHEST = 20.0
"""Highest order of an envelope spectrum."""

_LEVELS = (4, 8, 16, 32)
"""Numbers of bands into which the orders of the record are split in the search for a band."""
_MOST = 1024
"""Largest number of revolutions of a spectrum."""
_SLIP = 0.02
"""Relative distance within which a line of a bearing is searched, since its elements slip."""
_NEAR = 0.01
"""Distance in orders within which the line of a shaft is searched."""
_OVERSAMPLED = 4
"""Samples of an envelope relative to those that its band needs."""
_PEAKS, _LOBE = 10, 2
"""Largest number of lines without a name, and half the width of a line in bins."""
_FALSE_ALARM = 1e-4
"""Probability that noise alone makes a named order stand out."""


@dataclass(frozen=True, kw_only=True)
class EnvelopeSpectrum:
    """Spectrum of the envelope of a record in a band of orders.

    Attributes
    ----------
    band
        Lowest and highest order of the band.
    chosen
        Source of the band: ``kurtosis``, or ``stated``.
    kurtosis
        Excess kurtosis of the complex envelope in the band, 0 for Gaussian noise.
    spectrum
        ``order``, ``amplitude`` (peak, in the unit of the record) and ``level`` of the envelope.
    lines
        Orders of shafts and bearings, and the ten lines without a name that stand out most: ``name``, ``kind``,
        ``order`` (of the line), ``nominal`` (without slip), ``amplitude``, ``over_level``, ``stands_out``.
    """

    band: tuple[float, float]
    chosen: str
    kurtosis: float
    spectrum: pd.DataFrame
    lines: pd.DataFrame


def envelope_spectrum(
    x: FloatArray,
    *,
    samples_per_rev: int,
    highest: float,
    orders: Iterable[NamedOrder] = (),
    band: tuple[float, float] | None = None,
) -> EnvelopeSpectrum:
    r"""Return the envelope spectrum of a record, without what repeats each revolution.

    The average over the revolutions is taken out of the record, since it holds the gear; bearings slip and stay. The
    rest is made analytic in a band. The spectrum is that of the magnitude of this complex envelope y, less its mean,
    under a Hann window. Without a stated band it is that with the greatest

    .. math:: K = \langle |y|^4 \rangle / \langle |y|^2 \rangle^2 - 2

    of 4, 8, 16 and 32 equal bands below the highest order (a kurtogram).

    Parameters
    ----------
    x
        (K * samples_per_rev,) record in equal steps of angle.
    samples_per_rev
        Samples in a revolution.
    highest
        Highest order of the record.
    orders
        Orders of shafts and bearings to mark.
    band
        Lowest and highest order of the band.

    Returns
    -------
    EnvelopeSpectrum

    Raises
    ------
    InputError
        If the band does not rise, or reaches beyond the record.

    References
    ----------
    .. [1] Antoni, "Fast computation of the kurtogram for the detection of transient faults", Mechanical Systems and
       Signal Processing 21(1), 2007, doi:10.1016/j.ymssp.2005.12.002.
    .. [2] Randall, Antoni, "Rolling element bearing diagnostics - a tutorial", Mechanical Systems and Signal
       Processing 25(2), 2011, doi:10.1016/j.ymssp.2010.07.017.

    Examples
    --------
    >>> import numpy as np
    >>> turns = np.arange(64 * 512) / 512
    >>> knocks = (1 + np.cos(2 * np.pi * 3.58 * turns)) * np.cos(2 * np.pi * 100.3 * turns)
    >>> found = envelope_spectrum(knocks, samples_per_rev=512, highest=256.0, band=(90.0, 110.0)).spectrum
    >>> float(found["order"][found["amplitude"].idxmax()])
    3.578125
    """
    rows = x.reshape(-1, samples_per_rev)[:_MOST]
    rest = (rows - rows.mean(axis=0)).ravel()
    revolutions, top = len(rows), min(highest, samples_per_rev / 2)
    spectrum = np.fft.rfft(rest)
    if band is None:
        chosen, band = "kurtosis", _most_impulsive(spectrum, revolutions, top)
    elif 0 <= band[0] < band[1] <= top:
        chosen = "stated"
    else:
        raise InputError(
            f"envelope_band = {band[0]:g} to {band[1]:g} orders must rise within 0 to {top:.5g}, the record's highest"
        )
    envelope = _envelope(spectrum, revolutions, band)
    table = _spectrum(np.abs(envelope), revolutions, band)
    return EnvelopeSpectrum(
        band=band, chosen=chosen, kurtosis=_kurtosis(envelope), spectrum=table, lines=_lines(table, orders)
    )


def _envelope(spectrum: ComplexArray, revolutions: int, band: tuple[float, float]) -> ComplexArray:
    """Return the complex envelope of a band, in four times as many samples as it needs, on the record's scale.

    Its magnitude reaches beyond the band; with fewer samples those orders would fold back to lower ones.
    """
    first, stop = (round(order * revolutions) for order in band)
    inside = spectrum[first : max(stop, first + 2)]
    samples = _OVERSAMPLED * len(inside)
    return np.asarray(np.fft.ifft(inside, samples)) * (2 * samples / (2 * (len(spectrum) - 1)))


def _kurtosis(envelope: ComplexArray) -> float:
    power = np.abs(envelope) ** 2
    mean = float(power.mean())
    return float(np.mean(power**2)) / mean**2 - 2 if mean > np.finfo(float).tiny else 0.0


def _most_impulsive(spectrum: ComplexArray, revolutions: int, highest: float) -> tuple[float, float]:
    bands = [(highest * i / count, highest * (i + 1) / count) for count in _LEVELS for i in range(count)]
    wide = [band for band in bands if band[1] - band[0] >= 2]
    return max(wide or bands[: _LEVELS[0]], key=lambda band: _kurtosis(_envelope(spectrum, revolutions, band)))


def _spectrum(envelope: FloatArray, revolutions: int, band: tuple[float, float]) -> pd.DataFrame:
    from scipy.ndimage import median_filter

    window = np.hanning(len(envelope) + 1)[:-1]
    amplitude = np.abs(np.fft.rfft(2 * window / window.sum() * (envelope - envelope.mean())))
    bins = min(len(amplitude), int(min(HIGHEST, (band[1] - band[0]) / 2) * revolutions) + 1)
    level = median_filter(amplitude[:bins], max(3, 2 * (revolutions // 2) + 1), mode="reflect")
    return pd.DataFrame({"order": np.arange(bins) / revolutions, "amplitude": amplitude[:bins], "level": level})


def _lines(table: pd.DataFrame, orders: Iterable[NamedOrder]) -> pd.DataFrame:
    """Return the named orders with the greatest amplitude near each, which stands out by Rayleigh's law."""
    order, amplitude, level = (table[name].to_numpy(float) for name in ("order", "amplitude", "level"))
    bin_ = order[1] if len(order) > 1 else np.inf
    lines = []
    for named in orders:
        reach = max(2 * bin_, _SLIP * named.order if named.kind == "bearing" else _NEAR)
        near = np.flatnonzero(np.abs(order - named.order) <= reach)
        if not near.size or named.order > order[-1]:
            continue
        at = near[np.argmax(amplitude[near])]
        over = amplitude[at] / max(level[at], np.finfo(float).tiny)
        threshold = np.sqrt(np.log2(len(near) / _FALSE_ALARM))
        lines.append((named.name, named.kind, order[at], named.order, amplitude[at], over, bool(over >= threshold)))
    names = ["name", "kind", "order", "nominal", "amplitude", "over_level", "stands_out"]
    marked = np.array([line[2] for line in lines if line[-1]])
    return pd.DataFrame([*lines, *_unnamed(order, amplitude, level, marked)], columns=names).astype(
        {"stands_out": bool}
    )


def _unnamed(
    order: FloatArray, amplitude: FloatArray, level: FloatArray, marked: FloatArray
) -> list[tuple[str, str, float, float, float, float, bool]]:
    """Return the greatest lines without a name: a bearing of unknown geometry, another shaft."""
    from scipy.ndimage import maximum_filter1d

    over = amplitude / np.maximum(level, np.finfo(float).tiny)
    peaks = np.flatnonzero(
        (maximum_filter1d(amplitude, 2 * _LOBE + 1) == amplitude) & (np.arange(len(order)) > 2 * _LOBE)
    )
    peaks = peaks[over[peaks] >= np.sqrt(np.log2(len(order) / _FALSE_ALARM))]
    apart = np.abs(order[peaks, None] - marked).min(axis=1, initial=np.inf) > _LOBE * order[1:2].sum()
    greatest = peaks[apart][np.argsort(-over[peaks[apart]])][:_PEAKS]
    return [
        (f"order {order[k]:.2f}", "unnamed", order[k], order[k], amplitude[k], over[k], True) for k in np.sort(greatest)
    ]
