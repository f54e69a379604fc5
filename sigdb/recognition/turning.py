"""Inner products of averages with patterns that are turned to every tooth."""

import numpy as np
import scipy.fft

from sigdb.core.typing import FloatArray


class TurnedProducts:
    """Inner products ``<x, pattern turned by t teeth>`` for all t at once.

    A turn by a tooth is a shift by ``m = n / teeth`` samples, so with X and P the discrete Fourier transforms over the
    tooth passes of x and of a pattern p, both (teeth, m), the products are the inverse transform over q of
    ``sum_i X[q, i] conj(P[q, i])``: one small matrix product for each of the teeth / 2 + 1 frequencies.

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
        products = _over_teeth(np.asarray(x, float), self._teeth) @ self._conjugate
        return np.asarray(scipy.fft.irfft(products, self._teeth, axis=0, overwrite_x=True))


def _over_teeth(x: FloatArray, teeth: int) -> FloatArray:
    """(teeth // 2 + 1, rows, n / teeth) transform of rows (rows, n) over their tooth passes."""
    return np.asarray(scipy.fft.rfft(x.reshape(len(x), teeth, -1).transpose(1, 0, 2), axis=0))
