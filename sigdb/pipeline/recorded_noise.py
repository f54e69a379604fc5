"""The noise of a synchronous average, order by order, from what a record holds between the lines of its spectrum."""

import numpy as np

from sigdb.core.typing import FloatArray
from sigdb.pipeline.recorded_lines import record_spectrum

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
