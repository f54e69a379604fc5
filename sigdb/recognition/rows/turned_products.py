"""Inner products of averages with patterns that are turned by any number of teeth."""

import numpy as np
import scipy.fft

from sigdb.core import FloatArray


class TurnedProducts:
    """Inner products ``<x, pattern turned by t teeth>`` for all t at once.

    A turn by a tooth is a shift by ``m = n / teeth`` samples. X and P are the discrete Fourier transforms over the
    tooth passes of x and of a pattern p, both (teeth, m). The products are then the inverse transform over q of
    ``sum_i X[q, i] conj(P[q, i])``. This takes one small matrix product for each of the teeth / 2 + 1 frequencies.

    Parameters
    ----------
    patterns
        (patterns, n) real patterns, as they lie with the first tooth in front.
    teeth
        Tooth count; it divides n.
    """

    def __init__(self, patterns: FloatArray, teeth: int) -> None:
        self._teeth = teeth
        spectrum = _over_teeth(np.asarray(patterns, float), teeth)
        self._conjugate = np.ascontiguousarray(spectrum.conj().transpose(0, 2, 1))

    def __call__(self, x: FloatArray) -> FloatArray:
        """(teeth, rows, patterns) products of averages x (rows, n); entry t is with the patterns turned by t teeth."""
        spectrum = _over_teeth(np.asarray(x, float), self._teeth)
        products = np.empty((*spectrum.shape[:2], self._conjugate.shape[2]), complex)
        ends = [0, self._teeth // 2] if self._teeth % 2 == 0 else [0]  # these are real, which takes a quarter
        products[ends] = spectrum[ends].real @ self._conjugate[ends].real
        between = slice(1, len(spectrum) - (self._teeth % 2 == 0))
        np.matmul(spectrum[between], self._conjugate[between], out=products[between])
        return np.asarray(scipy.fft.irfft(products, self._teeth, axis=0, overwrite_x=True))


def _over_teeth(x: FloatArray, teeth: int) -> FloatArray:
    """(teeth // 2 + 1, rows, n / teeth) transform of rows (rows, n) over their tooth passes."""
    return np.asarray(scipy.fft.rfft(x.reshape(len(x), teeth, -1).transpose(1, 0, 2), axis=0))
