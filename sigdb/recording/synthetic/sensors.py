"""The sensors of a synthetic recording: a resonance in the path, noise, and a tacho."""

import numpy as np

from sigdb.core import FloatArray, Section, quantity


class SensorResonance(Section):
    """A path of one degree of freedom, ``H(s) = gain w0^2 / (s^2 + 2 zeta w0 s + w0^2)`` with ``w0 = 2 pi frequency``.

    It represents an accelerometer on its mounting (published: ISO 5348), or a wall of the housing between gear and
    sensor. The numbers are assumed: a stud on a clean surface resonates at 25 to 30 kHz, a magnet at 5 to 8 kHz.
    """

    frequency: float = quantity("Hz", "Natural frequency.", gt=0, default=28e3)
    damping_ratio: float = quantity("-", "Damping ratio zeta.", gt=0, default=0.03)
    gain: float = quantity("-", "Gain far below the resonance; negative for a sensor mounted upside down.", default=1.0)


def through_path(x: FloatArray, sampling_rate: float, path: SensorResonance) -> FloatArray:
    """Return a signal behind a path that had been at rest at the first sample's value.

    The bilinear transform with ``s = c (1 - 1/z) / (1 + 1/z)``, ``c = w0 / tan(w0 / (2 sampling_rate))``, is exact at
    frequency 0 and at the resonance.

    Parameters
    ----------
    x
        (samples,) signal in any unit.
    sampling_rate
        Sampling rate in Hz, above twice the path's frequency.
    path
        The path.

    Returns
    -------
    numpy.ndarray
        (samples,) float64, in the unit of x.
    """
    from scipy.signal import lfilter, lfilter_zi  # slow to load

    w = 2 * np.pi * path.frequency
    c = w / np.tan(w / (2 * sampling_rate))
    b = path.gain * w**2 * np.array([1.0, 2.0, 1.0])
    damped = 2 * path.damping_ratio * w * c
    a = np.array([c**2 + damped + w**2, 2 * (w**2 - c**2), c**2 - damped + w**2])
    b, a = b / a[0], a / a[0]
    filtered, _ = lfilter(b, a, x, zi=lfilter_zi(b, a) * x[0])
    return np.asarray(filtered)


class Noise(Section):
    """Gaussian noise of the sensor and of everything that is not modelled, white or stronger at low frequencies.

    Both kinds have the same variance; the colour only distributes it over frequency. A first-order low-pass colour is
    assumed: it is the simplest that falls with frequency, as the background of machines does.
    """

    snr_db: float = quantity(
        "dB", "10 log10(variance of the nominal healthy average / variance of the recording's noise).", default=0.0
    )
    corner_frequency: float | None = quantity(
        "Hz", "Frequency above which the density falls with its square; white noise if left out.", gt=0, default=None
    )


def coloured_noise(
    stream: np.random.Generator, shape: tuple[int, ...], sampling_rate: float, corner_frequency: float | None = None
) -> FloatArray:
    """Draw stationary Gaussian noise of variance 1, time on the last axis.

    It is a first-order autoregression, ``x_n = a x_{n-1} + sqrt(1 - a^2) w_n`` with ``a = exp(-2 pi corner / rate)``.
    Its density relative to white noise is ``(1 - a^2) / |1 - a exp(-2 pi i f / rate)|^2``.

    Parameters
    ----------
    stream
        Random stream; the same numbers are drawn for any colour.
    shape
        (..., samples) shape.
    sampling_rate, corner_frequency
        Rates in Hz; white noise without a corner.

    Returns
    -------
    ndarray
        (..., samples) noise without a unit.
    """
    white = stream.standard_normal(shape)
    if corner_frequency is None:
        return white
    from scipy.signal import lfilter  # slow to load

    a = np.exp(-2 * np.pi * corner_frequency / sampling_rate)
    b = np.sqrt(1 - a**2)
    # The first sample already has the variance of the others.
    noise, _ = lfilter([b], [1.0, -a], white, zi=(1 - b) * white[..., :1])
    return np.asarray(noise)


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
