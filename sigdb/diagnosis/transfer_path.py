"""Transfer path from the mesh to a sensor, from the mesh harmonics of a healthy recording."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import BoolArray, ComplexArray, FloatArray, InputError, IntArray, plain_array

_ABOVE_NOISE = 10.0
"""Amplitude of a mesh harmonic, in standard deviations of the noise at an order, above which its gain is used."""

_ERROR = 0.3
"""Standard deviation of the relative error of an interpolated gain; assumed."""

_OF_GREATEST = 1e-3
"""Share of the greatest simulated mesh harmonic below which one is too small to divide by."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferPath:
    """Gain from a simulated average to a measured one, order by order.

    Attributes
    ----------
    gain
        (n / 2 + 1,) complex gain of each order, in units of the measured signal per unit of the simulated one; 0 at
        orders whose gain is unknown.
    harmonics
        Mesh harmonics from which the gain is determined.
    samples
        Samples n of an average.
    error
        Standard deviation of the relative error of the gain between mesh harmonics.
    """

    gain: ComplexArray
    harmonics: IntArray
    samples: int
    error: float = _ERROR

    @property
    def covered(self) -> BoolArray:
        """(n / 2 + 1,) whether the gain of each order is determined."""
        return self.gain != 0

    def __call__(self, x: ArrayLike, axis: int = -1) -> FloatArray:
        """Return averages (..., n) along an axis behind the path."""
        return apply_gain(x, self.gain, axis)

    def band(self, x: ArrayLike, axis: int = -1) -> FloatArray:
        """Return the part of averages (..., n) at the orders that the path covers."""
        return apply_gain(x, self.covered, axis)


def direct_path(samples: int, *, highest: float) -> TransferPath:
    """Return a path of gain 1, for averages (samples,) of records up to a highest order."""
    order = np.arange(samples // 2 + 1)
    return TransferPath(gain=((order > 0) & (order <= highest)) + 0j, harmonics=order[:0], samples=samples, error=0.0)


def transfer_path(measured: ArrayLike, simulated: ArrayLike, *, teeth: int, noise: ArrayLike) -> TransferPath:
    """Return the path from a simulated average of a healthy gear to a measured average.

    At the mesh harmonics both averages are known, and their quotient is the gain. Between two neighbouring harmonics
    the logarithm of its magnitude and its phase are straight lines, the phase by the shorter way. For half a harmonic
    beyond the ends of a row of neighbours the magnitude is constant and the line of the phase continues. This holds
    if the structure between mesh and sensor changes little over one mesh harmonic. Other orders have the gain 0 and
    take no part in the comparison.

    Parameters
    ----------
    measured, simulated
        (n,) averages of one revolution.
    teeth
        Tooth count of the averaged gear.
    noise
        Standard deviation of the measured average's noise: a number, or (n / 2 + 1,) of each order.

    Returns
    -------
    TransferPath

    Raises
    ------
    InputError
        If no mesh harmonic stands above the noise.

    Examples
    --------
    >>> import numpy as np
    >>> angle = 2 * np.pi * np.arange(128) / 128
    >>> simulated = np.cos(8 * angle) + 0.5 * np.cos(16 * angle)
    >>> path = transfer_path(3 * simulated, simulated, teeth=8, noise=0.01)
    >>> path.harmonics.tolist(), bool(np.allclose(path.gain[path.covered], 3))
    ([1, 2], True)
    """
    x = plain_array("transfer_path", "measured", measured, float)
    y = plain_array("transfer_path", "simulated", simulated, float)
    n = len(x)
    X, Y = np.fft.rfft(x), np.fft.rfft(y)
    k = np.arange(1, (n // 2 - teeth // 2) // teeth + 1)
    floor = np.broadcast_to(plain_array("transfer_path", "noise", noise, float), X.shape) * np.sqrt(n / 2)
    audible = np.abs(X[k * teeth]) > _ABOVE_NOISE * floor[k * teeth]
    excited = np.abs(Y[k * teeth]) > _OF_GREATEST * np.abs(Y[k * teeth]).max(initial=0.0)
    used = k[audible & excited]
    if not used.size:
        raise InputError(
            f"no mesh harmonic of {teeth} teeth stands above the noise of the healthy recording, so the path from mesh "
            "to sensor cannot be determined; give a longer one, another channel, or the right tooth count"
        )
    gain = np.zeros(len(X), complex)
    for row in np.split(used, np.flatnonzero(np.diff(used) > 1) + 1):
        at = X[row * teeth] / Y[row * teeth]
        orders = np.arange(row[0] * teeth - teeth // 2, row[-1] * teeth + (teeth + 1) // 2)
        phase = _continued(orders, row * teeth, np.unwrap(np.angle(at)))
        gain[orders] = np.exp(np.interp(orders, row * teeth, np.log(np.abs(at))) + 1j * phase)
    return TransferPath(gain=gain, harmonics=used, samples=n)


def _continued(x: IntArray, xp: IntArray, fp: FloatArray) -> FloatArray:
    """Interpolate linearly and continue the first and last lines: a delay is a line."""
    inside = np.interp(x, xp, fp)
    if len(xp) < 2:
        return inside
    slope = np.diff(fp) / np.diff(xp)
    return inside + slope[0] * np.minimum(x - xp[0], 0) + slope[-1] * np.maximum(x - xp[-1], 0)


def apply_gain(x: ArrayLike, gain: ArrayLike, axis: int = -1) -> FloatArray:
    """Return averages (..., n) along an axis behind a gain (n / 2 + 1,)."""
    x = plain_array("apply_gain", "x", x, float)
    shape = [1] * x.ndim
    shape[axis] = -1
    return np.fft.irfft(np.asarray(gain).reshape(shape) * np.fft.rfft(x, axis=axis), x.shape[axis], axis)
