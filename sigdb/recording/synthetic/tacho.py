"""The tacho of a recording: its pulses and the uncertainty of their times."""

import numpy as np

from sigdb.core import FloatArray, Section, quantity


class Tacho(Section):
    """A tacho whose pulses rise through half of their height at the marks."""

    shaft: str | None = quantity("-", "Shaft with the tacho; the damaged gear's if left out.", default=None)
    pulses_per_revolution: int = quantity("-", "Pulses in a revolution of that shaft.", ge=1, default=1)
    jitter: float = quantity(
        "s",
        "Standard deviation of a pulse's time; a pulse rounded to the nearest of samples at a rate f has "
        "1 / (f sqrt(12)).",
        ge=0,
        default=0.0,
    )


def jitter_times(stream: np.random.Generator, pulse_times: FloatArray, jitter: float) -> FloatArray:
    """Return (pulses,) times in s, each with an independent normal delay of standard deviation ``jitter``, s.

    In an average that is cut at such pulses, a harmonic of frequency f keeps ``exp(-(2 pi f jitter)^2 / 2)`` of its
    amplitude.
    """
    return pulse_times + jitter * stream.standard_normal(len(pulse_times))


def pulse_waveform(pulse_times: FloatArray, sampling_rate: float, samples: int, *, width: float) -> FloatArray:
    """Return the waveform of a tacho, from 0 to 1: ramps of two samples that cross one half at the pulses' times.

    A ramp is straight over the two samples about its middle, so that linear interpolation finds the time exactly.

    Parameters
    ----------
    pulse_times
        (pulses,) times in s, sample 0 at time 0, further apart than ``width`` and four samples.
    sampling_rate
        Sampling rate, Hz.
    samples
        Length of the record.
    width
        Time from a rise to the next fall, s, more than two samples.

    Returns
    -------
    numpy.ndarray
        (samples,) float64.

    Examples
    --------
    >>> from sigdb.signature import tacho_pulses
    >>> waveform = pulse_waveform(np.array([0.0105, 0.0203]), 1000.0, 40, width=0.005)
    >>> tacho_pulses(waveform, 1000.0).round(6).tolist()
    [0.0105, 0.0203]
    """
    half = 1 / sampling_rate
    corners = np.array([-half, half, width - half, width + half])
    knots = (pulse_times[:, None] + corners).ravel()
    return np.interp(np.arange(samples) / sampling_rate, knots, np.tile([0.0, 1.0, 1.0, 0.0], len(pulse_times)))
