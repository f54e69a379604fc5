"""Noise of a recording, white or coloured."""

import numpy as np

from sigdb.core import FloatArray, Section, quantity


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
    :func:`relative_density` is its density relative to white noise.

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


def relative_density(frequency: FloatArray, sampling_rate: float, corner_frequency: float | None) -> FloatArray:
    """Return the power density of :func:`coloured_noise` relative to white noise of the same variance.

    It is ``(1 - a^2) / |1 - a exp(-2 pi i f / rate)|^2``, mean 1 over the band.

    Parameters
    ----------
    frequency
        Frequencies in Hz, of any shape.
    sampling_rate, corner_frequency
        Rates in Hz; the density is 1 everywhere without a corner.
    """
    frequency = np.asarray(frequency, float)
    if corner_frequency is None:
        return np.ones_like(frequency)
    a = np.exp(-2 * np.pi * corner_frequency / sampling_rate)
    return np.asarray((1 - a**2) / np.abs(1 - a * np.exp(-2j * np.pi * frequency / sampling_rate)) ** 2)
