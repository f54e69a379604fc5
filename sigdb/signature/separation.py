"""Regular, residual and difference signals, by zeroing FFT bins of the average.

The average is one revolution, so the orders to separate are whole bins: no filter, no transient, and the parts are
orthogonal.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import IntArray
from sigdb.signature.checks import Float64Array, real_signal
from sigdb.signature.gear_orders import gear_orders


def regular_signal(
    tsa: ArrayLike, *, teeth: int, mesh_harmonics: int | None = None, shaft_harmonics: int = 2
) -> Float64Array:
    """Compute the regular part of an average: shaft orders 1 ... S and mesh orders Z, 2Z, ... HZ, without the mean.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.
    teeth : int
        Tooth count Z of the gear on the averaged shaft; below n/2.
    mesh_harmonics : int, optional
        Count H of mesh harmonics; all below Nyquist by default. The Nyquist bin itself is never regular.
    shaft_harmonics : int
        Count S of shaft orders.

    Returns
    -------
    (..., n) float64
        In the unit of ``tsa``.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite, a count is negative or not an integer, or a requested order is not
        below n/2.

    References
    ----------
    .. [1] Zakrajsek, Townsend, Decker, "An Analysis of Gear Fault Detection Methods as Applied to Pitting Fatigue
       Failure Data", NASA TM-105950, 1993.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import regular_signal
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> mesh, sideband = np.cos(8 * theta), 0.1 * np.cos(9 * theta)
    >>> np.allclose(regular_signal(5 + mesh + sideband, teeth=8), mesh, atol=1e-12)
    True
    """
    x, _ = real_signal("regular_signal", "tsa", tsa)
    orders = gear_orders("regular_signal", x.shape[-1], teeth, mesh_harmonics, shaft_harmonics)
    X = np.fft.rfft(x)
    return synthesis(X - without(X, orders.regular), x.shape[-1])


def residual_signal(
    tsa: ArrayLike, *, teeth: int, mesh_harmonics: int | None = None, shaft_harmonics: int = 2
) -> Float64Array:
    """Compute the residual of an average: its mean and its regular part are removed, the sidebands of the mesh stay.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.
    teeth, mesh_harmonics, shaft_harmonics
        As in :func:`regular_signal`.

    Returns
    -------
    (..., n) float64
        ``tsa - mean - regular_signal(tsa)``, in the unit of ``tsa``.

    Raises
    ------
    InputError
        As :func:`regular_signal`.

    References
    ----------
    .. [1] Zakrajsek, Townsend, Decker, NASA TM-105950, 1993.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import residual_signal
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> mesh, sideband = np.cos(8 * theta), 0.1 * np.cos(9 * theta)
    >>> np.allclose(residual_signal(5 + mesh + sideband, teeth=8), sideband, atol=1e-12)
    True
    """
    x, _ = real_signal("residual_signal", "tsa", tsa)
    orders = gear_orders("residual_signal", x.shape[-1], teeth, mesh_harmonics, shaft_harmonics)
    return synthesis(without(np.fft.rfft(x), orders.residual_removes), x.shape[-1])


def difference_signal(
    tsa: ArrayLike,
    *,
    teeth: int,
    mesh_harmonics: int | None = None,
    shaft_harmonics: int = 2,
    sidebands: int = 1,
) -> Float64Array:
    """Compute the difference signal: the residual without the first pairs of sidebands of each mesh harmonic.

    The sidebands are at the orders ``h Z +- 1 ... sidebands``.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.
    teeth, mesh_harmonics, shaft_harmonics
        As in :func:`regular_signal`.
    sidebands : int
        Pairs about each mesh harmonic; 0 leaves the residual. A sideband at or above n/2, or at or below order 0, is
        not in the spectrum: nothing is removed for it.

    Returns
    -------
    (..., n) float64
        In the unit of ``tsa``.

    Raises
    ------
    InputError
        As :func:`regular_signal`.

    References
    ----------
    .. [1] Zakrajsek, Townsend, Decker, NASA TM-105950, 1993.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import difference_signal
    >>> theta = 2 * np.pi * np.arange(64) / 64
    >>> first, third = 0.1 * np.cos(9 * theta), 0.05 * np.cos(11 * theta)
    >>> np.allclose(difference_signal(np.cos(8 * theta) + first + third, teeth=8), third, atol=1e-12)
    True
    """
    x, _ = real_signal("difference_signal", "tsa", tsa)
    orders = gear_orders("difference_signal", x.shape[-1], teeth, mesh_harmonics, shaft_harmonics, sidebands)
    return synthesis(without(np.fft.rfft(x), orders.difference_removes), x.shape[-1])


def without(X: NDArray[np.complex128], orders: IntArray) -> NDArray[np.complex128]:
    """Return a spectrum with some bins zeroed."""
    kept = X.copy()
    kept[..., orders] = 0
    return kept


def synthesis(X: NDArray[np.complex128], n: int) -> Float64Array:
    """Return the signal of n samples whose FFT has the bins X."""
    return np.fft.irfft(X, n)
