"""The smallest event that a record would have shown, by adding events to the record itself."""

import math

import numpy as np

from sigdb.core import ComplexArray
from sigdb.recording.evidence.residual_bands import ResidualBands

PROBABILITY = 0.95
"""Share of the added events that must be seen."""
_EVENTS = 40
"""Events that are added, at places spread evenly over the turn."""
_LEAST = 1e-3
"""Smallest event that is tried."""
_STEPS = 7
"""Steps of the search, which halve the logarithmic interval: 6 % at the end."""


def least_event(bands: ResidualBands, spectrum: ComplexArray, limit: float) -> float:
    """Return the smallest event that is seen at 95 of 100 places of the turn, over the rms of the average.

    An event is one short pulse with the spectrum of the residual's own level, all orders of the bands together, and a
    phase of its own in each band. Forty of them are added, one at a time.

    Parameters
    ----------
    bands
        Bands of the record.
    spectrum
        (K,) spectrum of the average.
    limit
        Ratio of a pulse's energy to that of the other teeth, above which it is seen.

    Returns
    -------
    float
        rms of the event over that of the average without its mean, not below 1e-3; nan if an event of the average's
        whole rms would not have been seen.
    """
    residual = spectrum[bands.orders]
    level = bands.level(residual)
    event = float(bands.teeth * np.sum(np.mean(level, axis=1)))
    average = float(np.sum(np.abs(spectrum[1:]) ** 2))
    events = np.sqrt(level * (average / event)) * _phases(bands)

    def is_seen(share: float) -> bool:
        ratios = bands.pulses(residual + share * events).ratio
        return bool(np.mean(ratios > limit) >= PROBABILITY)

    if not is_seen(1.0):
        return math.nan
    low, high = math.log(_LEAST), 0.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        low, high = (low, middle) if is_seen(math.exp(middle)) else (middle, high)
    return math.exp(high)


def _phases(bands: ResidualBands) -> ComplexArray:
    """Return the phases (E, H, S) of events at places spread over the turn."""
    stream = np.random.default_rng(0)
    phase = stream.random((_EVENTS, len(bands.orders), 1))
    place = (np.arange(_EVENTS) + stream.random(_EVENTS)) / _EVENTS
    return np.asarray(np.exp(2j * np.pi * (phase - bands.orders * place[:, None, None])))
