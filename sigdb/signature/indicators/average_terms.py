"""Quantities of an average that several indicators share, each computed at most once."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sigdb.signature.checks import Float64Array
from sigdb.signature.gear_orders import GearOrders
from sigdb.signature.indicators import moment_kernels
from sigdb.signature.separation import synthesis, without
from sigdb.signature.spectrum import one_sided


class AverageTerms:
    """Terms of a batch of averages ``(m, n)``, from one spectrum and one separation.

    All terms are those of the averages in units of their largest modulus, ``u = x / s``. An indicator that has a unit
    multiplies by ``scale``.

    Parameters
    ----------
    x : (m, n) float64
        Averages of one revolution.
    teeth : int
        Tooth count Z.
    orders : GearOrders
        Orders of the regular and of the difference signal.
    eps : float
        Relative precision of the type that the averages came in.
    """

    def __init__(self, x: Float64Array, teeth: int, orders: GearOrders, eps: float) -> None:
        self.n = x.shape[-1]
        self.teeth = teeth
        self.orders = orders
        self.average, self.scale = moment_kernels.per_peak(x)
        self.floor = moment_kernels.rounding_floor(eps)
        """Largest mean square of a signal without variance."""

    @cached_property
    def peak_to_peak(self) -> Float64Array:
        """Largest minus smallest sample."""
        return np.ptp(self.average, axis=-1)

    @cached_property
    def rms(self) -> Float64Array:
        """Root mean square, the mean included."""
        return np.sqrt(moment_kernels.mean_square(self.average))

    @cached_property
    def variance(self) -> Float64Array:
        """Population variance."""
        return moment_kernels.variance(self.average)

    @cached_property
    def spectrum(self) -> NDArray[np.complex128]:
        """Bins of the FFT, ``(m, n//2 + 1)``."""
        return np.fft.rfft(self.average)

    @cached_property
    def amplitudes(self) -> Float64Array:
        """Peak amplitudes by order, ``(m, n//2 + 1)``."""
        return np.abs(self.spectrum) * one_sided(self.n)

    @cached_property
    def regular_mean_square(self) -> Float64Array:
        """Mean square of the regular signal, by Parseval's theorem without a transform back."""
        regular = self.amplitudes[..., self.orders.regular]
        return moment_kernels.dot(regular, regular) / 2

    @cached_property
    def difference(self) -> Float64Array:
        """The difference signal, ``(m, n)``."""
        return synthesis(without(self.spectrum, self.orders.difference_removes), self.n)

    @cached_property
    def difference_moments(self) -> tuple[Float64Array, ...]:
        """Normalised moments of order 4, 6 and 8 of the difference signal."""
        return moment_kernels.moment_ratios(self.difference, (4, 6, 8), self.floor)
