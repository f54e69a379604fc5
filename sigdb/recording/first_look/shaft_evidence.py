"""Evidence of each shaft in the envelope of a record: whether something repeats with its turn."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from sigdb.recording.first_look.envelope_spectrum import EnvelopeSpectrum
from sigdb.recording.orders import NamedOrder

_HARMONICS = 5
"""Harmonics of a shaft's order that are combined."""

_GUARD, _ABOUT = 2, 0.2
"""Bins about a line that are its own, and the distance, relative to a shaft's order, of the bins about it."""

_LEAST_BINS = 8
"""Fewest bins about a line; with fewer, a line has no evidence."""

_WIDTH = 1.5
"""Bins under a Hann window that are worth one independent bin."""


def shaft_evidence(envelope: EnvelopeSpectrum, shafts: Iterable[NamedOrder]) -> pd.DataFrame:
    r"""Return the probability that noise alone gives such lines of each shaft in an envelope spectrum.

    Let q be the power of the spectrum at a harmonic of a shaft over the mean power of N independent bins about it. For
    noise it follows the F distribution with 2 and 2N degrees of freedom [1]_. The probabilities ``(1 + q / N)^(-N)`` of
    the first five harmonics are combined after Fisher [2]_. Harmonics that are one of another shaft count for both,
    unless they are whole orders: the average, which holds those of the averaged shaft, is not in the envelope.

    Parameters
    ----------
    envelope
        Envelope spectrum of a record without its average.
    shafts
        Orders of the shafts.

    Returns
    -------
    pandas.DataFrame
        ``shaft``, ``order``, ``lines`` (harmonics that were combined), ``p_value``.

    References
    ----------
    .. [1] Thomson, "Spectrum estimation and harmonic analysis", Proceedings of the IEEE 70(9), 1982,
       doi:10.1109/PROC.1982.12433.
    .. [2] Fisher, Statistical Methods for Research Workers, 4th edition, 1932, section 21.1.

    Examples
    --------
    >>> turns = np.arange(200 * 256) / 256
    >>> noise = np.random.default_rng(0).standard_normal(turns.size)
    >>> knocks = (1 + 0.5 * np.cos(2 * np.pi * 0.4 * turns)) * noise
    >>> from sigdb.recording.first_look.envelope_spectrum import envelope_spectrum
    >>> spectrum = envelope_spectrum(knocks, samples_per_rev=256, highest=100.0, band=(10.0, 90.0))
    >>> shafts = [NamedOrder(name=name, kind="shaft", order=order) for name, order in (("wheel", 0.4), ("other", 0.73))]
    >>> table = shaft_evidence(spectrum, shafts).set_index("shaft")
    >>> bool(table.loc["wheel", "p_value"] < 1e-3 < table.loc["other", "p_value"])
    True
    """
    from scipy.special import gammaincc

    order, power = (envelope.spectrum[name].to_numpy(float) for name in ("order", "amplitude"))
    power = power**2
    step = float(order[1] - order[0]) if len(order) > 1 else np.inf
    rows = []
    for shaft in shafts:
        logarithms = [
            _log_p(power, h * shaft.order / step, shaft.order * _ABOUT / step)
            for h in range(1, _HARMONICS + 1)
            if abs(h * shaft.order - round(h * shaft.order)) > _GUARD * step
        ]
        held = [value for value in logarithms if np.isfinite(value)]
        p = float(gammaincc(len(held), -sum(held))) if held else np.nan
        rows.append({"shaft": shaft.name, "order": shaft.order, "lines": len(held), "p_value": p})
    return pd.DataFrame(rows, columns=["shaft", "order", "lines", "p_value"])


def _log_p(power: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]", place: float, reach: float) -> float:
    """Return the logarithm of the probability of the power at a bin among the bins about it; nan if there are few."""
    centre = round(place)
    distance = np.arange(-max(int(reach), _LEAST_BINS), max(int(reach), _LEAST_BINS) + 1)
    bins = centre + distance[np.abs(distance) > _GUARD]
    bins = bins[(bins > _GUARD) & (bins < len(power))]
    if centre >= len(power) - 1 or centre <= _GUARD or len(bins) < _LEAST_BINS:
        return np.nan
    N = len(bins) / _WIDTH
    level = max(float(power[bins].mean()), np.finfo(float).tiny)
    return float(-N * np.log1p(power[centre] / level / N))
