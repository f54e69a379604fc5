"""The band about a mesh harmonic, moved down to order 0."""

import numpy as np
from numpy.typing import NDArray

from sigdb.core import IntArray


def default_half_width(teeth: int) -> int:
    """As many orders on either side as do not reach into the next harmonic's band."""
    return (teeth - 1) // 2


def baseband(X: NDArray[np.complex128], n: int, centre: IntArray, half_width: int) -> NDArray[np.complex128]:
    """Twice the bins ``centre +- half_width`` of an rfft, as a signal about order 0, ``(..., n)``.

    ``centre`` has an entry for each of the leading axes of X, or broadcasts to them. Orders at or below 0, or at or
    above n/2, are not in the spectrum.
    """
    # No order between 0 and n/2 is farther than that from another.
    w = min(half_width, (n - 1) // 2)
    j = np.arange(-w, w + 1)
    orders = centre[..., None] + j
    inside = (orders > 0) & (2 * orders < n)
    bins = np.take_along_axis(X, np.broadcast_to(np.where(inside, orders, 0), (*X.shape[:-1], j.size)), axis=-1)
    C = np.zeros((*X.shape[:-1], n), dtype=np.complex128)
    C[..., j] = 2 * bins * inside
    return np.fft.ifft(C)
