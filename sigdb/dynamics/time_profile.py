"""A speed or a torque over time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError, plain_array


@dataclass(frozen=True)
class TimeProfile:
    """A quantity over time: straight lines between points, constant before the first and after the last.

    Attributes
    ----------
    time
        Times of the points, rising, s.
    value
        Values there.

    Examples
    --------
    A run-up from 600 to 3000 rpm in two seconds:

    >>> run_up = TimeProfile([0.0, 2.0], [600.0, 3000.0])
    >>> run_up(np.array([1.0, 3.0]))
    array([1800., 3000.])
    >>> run_up.integral(np.array([2.0]))
    array([3600.])
    """

    time: Sequence[float]
    value: Sequence[float]

    def __post_init__(self) -> None:
        time, value = (plain_array("TimeProfile", name, getattr(self, name), float) for name in ("time", "value"))
        if time.ndim != 1 or time.shape != value.shape or not len(time):
            raise InputError("a time profile needs as many values as times, at least one")
        if not (np.isfinite(time).all() and np.isfinite(value).all() and (np.diff(time) > 0).all()):
            raise InputError("a time profile needs finite values at finite, rising times")

    def __call__(self, t: FloatArray) -> FloatArray:
        """Return the values at times."""
        return np.interp(t, self.time, self.value)

    def slope(self, t: FloatArray) -> FloatArray:
        """Return the rate of change at times, 1/s; at a given time that of the line after it."""
        time, value = np.asarray(self.time, float), np.asarray(self.value, float)
        slopes = np.concatenate([[0.0], np.diff(value) / np.diff(time), [0.0]])
        return slopes[np.searchsorted(time, t, side="right")]

    def integral(self, t: FloatArray) -> FloatArray:
        """Return the exact integral from time 0 to times."""
        return self._since_first(np.asarray(t, float)) - self._since_first(np.zeros(1))[0]

    def _since_first(self, t: FloatArray) -> FloatArray:
        time, value = np.asarray(self.time, float), np.asarray(self.value, float)
        areas = np.concatenate([[0.0], np.cumsum(np.diff(time) * (value[1:] + value[:-1]) / 2)])
        at = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 1)
        return areas[at] + (t - time[at]) * (value[at] + self(t)) / 2

    def reached(self, wanted: FloatArray) -> FloatArray:
        """Return the times from 0 on at which the integral from time 0 has reached values; for a profile above zero.

        On a line ``v + a s`` the integral ``v s + a s^2 / 2`` reaches c at ``s = 2 c / (v + sqrt(v^2 + 2 a c))``.
        """
        points = np.unique(np.concatenate([[0.0], np.asarray(self.time, float).clip(min=0.0)]))
        areas = self.integral(points)
        at = np.clip(np.searchsorted(areas, wanted, side="right") - 1, 0, len(points) - 1)
        v, a, c = self(points[at]), self.slope(points[at]), np.asarray(wanted, float) - areas[at]
        return points[at] + 2 * c / (v + np.sqrt(np.maximum(v**2 + 2 * a * c, 0.0)))
