"""The analytic signal of a period."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sigdb.signature._validation import Float64Array


def analytic(x: NDArray[Any]) -> NDArray[np.complex128]:
    """A complex signal as it is, a real one with its negative orders moved onto the positive ones, (12)."""
    return x if np.iscomplexobj(x) else _from_real(x)


def _from_real(x: Float64Array) -> NDArray[np.complex128]:
    n = x.shape[-1]
    Z = np.zeros(x.shape, dtype=np.complex128)
    Z[..., : n // 2 + 1] = np.fft.rfft(x)
    # Mean and, for even n, Nyquist have no mirror: they are kept once.
    Z[..., 1 : (n + 1) // 2] *= 2
    return np.fft.ifft(Z)
