"""Tones of other shafts and of bearings, which follow the angle."""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, Section, quantity
from sigdb.transmission import RollingBearing


def sum_of_tones(turns: FloatArray, orders: ArrayLike, amplitudes: ArrayLike, phases: ArrayLike) -> FloatArray:
    """Return the sum of tones ``a cos(2 pi o turns + phase)``.

    Parameters
    ----------
    turns
        (samples,) angle of a shaft, revolutions.
    orders
        (k,) cycles per revolution o.
    amplitudes
        (k,) peak amplitudes a, in any unit.
    phases
        (k,) phases at angle 0, rad.

    Returns
    -------
    numpy.ndarray
        (samples,) float64, in the unit of the amplitudes.

    Examples
    --------
    >>> sum_of_tones(np.array([0.0, 0.25, 0.5]), [1.0], [2.0], [0.0]).round(9).tolist()
    [2.0, 0.0, -2.0]
    """
    total = np.zeros(len(turns))
    for order, amplitude, phase in zip(*np.broadcast_arrays(orders, amplitudes, phases), strict=True):
        total += amplitude * np.cos(2 * np.pi * order * turns + phase)
    return total


class ShaftTones(Section):
    """Components of another shaft: its unbalance, misalignment, a pump's vanes on it. Their sizes are assumed."""

    shaft: str | None = quantity("-", "A shaft of the rig; the damaged gear's if left out.", default=None)
    harmonics: tuple[float, ...] = quantity(
        "-", "Cycles in a revolution of that shaft; a belt or a pump may have fractions.", min_length=1,
        default=(1.0, 2.0),
    )  # fmt: skip
    amplitude: float = quantity(
        "-",
        "Peak amplitude of each, relative to the standard deviation of the nominal healthy average.",
        ge=0,
        default=0.5,
    )


class BearingTones(Section):
    """Tones of a damaged bearing: harmonic h of a passing order, of amplitude a / h. Their sizes are assumed."""

    bearing: RollingBearing
    shaft: str | None = quantity("-", "The shaft that it supports; the damaged gear's if left out.", default=None)
    outer: float = quantity(
        "-", "Amplitude a of the outer race, relative to the standard deviation of the nominal healthy average.", ge=0,
        default=0.5,
    )  # fmt: skip
    inner: float = quantity("-", "Amplitude a of the inner race, likewise.", ge=0, default=0.0)
    cage: float = quantity("-", "Amplitude a of the cage, likewise.", ge=0, default=0.0)
    spin: float = quantity("-", "Amplitude a of the elements' spin, likewise.", ge=0, default=0.0)
    harmonics: int = quantity("-", "Number of harmonics of each.", ge=1, default=3)

    @property
    def orders(self) -> FloatArray:
        """(4 harmonics,) cycles per revolution of the shaft."""
        bearing = self.bearing
        passing = [bearing.outer, bearing.inner, bearing.cage, bearing.spin]
        return np.outer(passing, 1 + np.arange(self.harmonics)).ravel()

    @property
    def amplitudes(self) -> FloatArray:
        """(4 harmonics,) amplitudes of the orders."""
        return np.outer([self.outer, self.inner, self.cage, self.spin], 1 / (1 + np.arange(self.harmonics))).ravel()
