"""Spectrum of a time-synchronous average against order."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import IntArray
from sigdb.signature.checks import Float64Array, real_signal


def order_spectrum(tsa: ArrayLike) -> tuple[IntArray, NDArray[np.complex128]]:
    r"""Compute the one-sided complex spectrum of an average; its modulus is the peak amplitude of each order.

    ``c[o] = 2/n sum_i tsa[i] exp(-2 pi j i o / n)``; DC and, for even n, Nyquist are not doubled. No window, since the
    average is periodic. ``A cos(o theta + phi)`` gives ``c[o] = A exp(j phi)``.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.

    Returns
    -------
    order : (n//2 + 1,) int
        Cycles per revolution.
    c : (..., n//2 + 1) complex128
        Complex amplitude in the unit of ``tsa``.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite.

    Notes
    -----
    Equation (10) of [1]_ is ``X(k) = T sum_i x[i] exp(-2 pi j i k / n)`` with T the sampling interval:
    ``c = 2 X / (n T)``, and ``X / (n T)`` at DC and Nyquist.

    References
    ----------
    .. [1] Choy, Polyshchuk, Zakrajsek, Handschuh, Townsend, "Analysis of the Effects of Surface Pitting and Wear on the
       Vibrations of a Gear Transmission System", Tribology International 29(1), 1996.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import order_spectrum
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> order, c = order_spectrum(1 + 3 * np.cos(12 * theta))
    >>> np.abs(c[[0, 12]]).round(12).tolist()
    [1.0, 3.0]
    """
    x, _ = real_signal("order_spectrum", "tsa", tsa)
    n = x.shape[-1]
    return np.arange(n // 2 + 1), np.fft.rfft(x) * one_sided(n)


def one_sided(n: int) -> Float64Array:
    """Return the factors from the bins of a real signal's FFT to one-sided amplitudes."""
    factor = np.full(n // 2 + 1, 2 / n)
    factor[0] = 1 / n
    if n % 2 == 0:
        factor[-1] = 1 / n
    return factor
