"""Demodulation of a mesh harmonic: its band moved down to order 0, its amplitude and its phase."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sigdb.core import IntArray
from sigdb.signature.checks import Float64Array, count, harmonics_below_nyquist, mesh_teeth, real_signal
from sigdb.signature.indicators import moment_kernels as _moments


def demodulate(
    tsa: ArrayLike, *, teeth: int, harmonic: int = 1, half_width: int | None = None
) -> tuple[Float64Array, Float64Array]:
    """Compute amplitude and phase modulation of a harmonic of the mesh over the revolution.

    The band of orders ``h Z - w ... h Z + w``, made analytic, times ``exp(-j h Z theta)`` is c. The amplitude
    modulation is ``|c| / mean|c| - 1``; the phase modulation is the unwrapped phase of c less its mean. So
    ``(1 + a(theta)) cos(h Z theta + b(theta))`` gives a and b, as far as they lie in the band and have no mean.

    Parameters
    ----------
    tsa : array_like, (..., n)
        Real averages of one revolution, in any unit.
    teeth : int
        Tooth count Z of the gear on the averaged shaft.
    harmonic : int
        Harmonic h of the mesh; ``h Z`` is below n/2.
    half_width : int, optional
        Half-width w in orders; ``(Z - 1) // 2`` by default. Orders at or below 0, or at or above n/2, are not in the
        spectrum.

    Returns
    -------
    amplitude : (..., n) float64
        Relative modulation, no unit.
    phase : (..., n) float64
        In radians of the harmonic, positive where it is ahead; divided by ``h Z``, in radians of rotation.

        Both are nan without anything in the band: where the mean square of c is at most ``(64 eps s)^2``, with eps of
        the input's type and s = ``max|average|``.

    Raises
    ------
    InputError
        If ``tsa`` is empty, complex or not finite, a count is too small or not an integer, or the harmonic is not below
        n/2.

    References
    ----------
    .. [1] McFadden, "Detecting fatigue cracks in gears by amplitude and phase demodulation of the meshing vibration",
       Journal of Vibration, Acoustics, Stress, and Reliability in Design 108(2), 1986, doi:10.1115/1.3269317.

    Examples
    --------
    >>> import numpy as np
    >>> from sigdb.signature import demodulate
    >>> theta = 2 * np.pi * np.arange(256) / 256
    >>> x = (1 + 0.3 * np.cos(theta)) * np.cos(16 * theta + 0.2 * np.sin(2 * theta))
    >>> amplitude, phase = demodulate(x, teeth=16)
    >>> np.allclose(amplitude, 0.3 * np.cos(theta), atol=1e-4), np.allclose(phase, 0.2 * np.sin(2 * theta), atol=1e-4)
    (True, True)
    """
    x, eps = real_signal("demodulate", "tsa", tsa)
    n = x.shape[-1]
    z = mesh_teeth("demodulate", teeth, n)
    h = harmonics_below_nyquist("demodulate", "harmonic", harmonic, spacing=z, n=n, least=1)
    w = default_half_width(z) if half_width is None else count("demodulate", "half_width", half_width, least=0)
    u, _ = _moments.per_peak(x)
    c = baseband(np.fft.rfft(u), n, np.array(h * z), w)
    envelope = np.abs(c)
    undefined = _moments.mean_square(envelope) <= _moments.rounding_floor(eps)
    mean = np.where(undefined, np.nan, np.mean(envelope, axis=-1))[..., None]
    phase = np.unwrap(np.angle(c), axis=-1)
    # nan where the mean is, a number of radians elsewhere.
    return envelope / mean - 1, phase - np.mean(phase, axis=-1, keepdims=True) + 0 * mean


def default_half_width(teeth: int) -> int:
    """Return the most orders on either side that do not reach into the next harmonic's band."""
    return (teeth - 1) // 2


def baseband(X: NDArray[np.complex128], n: int, centre: IntArray, half_width: int) -> NDArray[np.complex128]:
    """Return twice the bins ``centre +- half_width`` of an rfft as a signal about order 0, ``(..., n)``.

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
