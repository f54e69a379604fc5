"""Linear path with one resonance, from the position in the model to the signal of a sensor."""

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
