"""Tones of other shafts and of bearings, which follow the angle."""

import numpy as np
from numpy.typing import ArrayLike

from sigdb.core import FloatArray, Section, quantity


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


class RollingBearing(Section):
    """Geometry of a rolling bearing whose outer ring stands still; the passing orders follow from it.

    With n rolling elements, ``r = d/D cos(contact angle)`` and one revolution of the shaft: outer race
    ``n/2 (1 - r)``, inner race ``n/2 (1 + r)``, cage ``1/2 (1 - r)``, and a rolling element's spin
    ``D/(2 d) (1 - r^2)``, without slip (published: Randall, Antoni 2011, doi:10.1016/j.ymssp.2010.07.017).

    Examples
    --------
    The bearing 6205 of a much used test rig:

    >>> bearing = RollingBearing(rolling_elements=9, rolling_diameter=7.94e-3, pitch_diameter=39.04e-3)
    >>> round(bearing.outer, 3), round(bearing.inner, 3)
    (3.585, 5.415)
    """

    rolling_elements: int = quantity("-", "Number n of rolling elements.", ge=1)
    rolling_diameter: float = quantity("m", "Diameter d of a rolling element.", gt=0)
    pitch_diameter: float = quantity("m", "Diameter D of the circle of their centres.", gt=0)
    contact_angle_deg: float = quantity("deg", "Contact angle, 0 for a radial bearing.", ge=0, lt=90, default=0.0)

    @property
    def _r(self) -> float:
        return self.rolling_diameter / self.pitch_diameter * float(np.cos(np.deg2rad(self.contact_angle_deg)))

    @property
    def outer(self) -> float:
        """Order at which elements pass a point of the outer race (BPFO)."""
        return self.rolling_elements / 2 * (1 - self._r)

    @property
    def inner(self) -> float:
        """Order at which elements pass a point of the inner race (BPFI)."""
        return self.rolling_elements / 2 * (1 + self._r)

    @property
    def cage(self) -> float:
        """Order of the cage (FTF)."""
        return (1 - self._r) / 2

    @property
    def spin(self) -> float:
        """Order at which an element turns about itself (BSF)."""
        return self.pitch_diameter / (2 * self.rolling_diameter) * (1 - self._r**2)


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
