"""Time against the angle of a shaft, a cubic spline through the pulses of its tacho."""

import numpy as np

from sigdb.core import NotApplicableError
from sigdb.signature.checks import Float64Array

GUARD = 32
"""A pulse this many intervals away moves the spline by 0.27^32, less than rounding."""


class ShaftPhase:
    """Pulse times by their number; those that no longer matter may be forgotten."""

    def __init__(self, owner: str) -> None:
        self._owner = owner
        self.count = 0
        self.first = 0
        self._times: Float64Array = np.empty(0)

    @property
    def last(self) -> float:
        """Time of the last pulse, s; -inf without one."""
        return float(self._times[-1]) if self.count else -np.inf

    def append(self, times: Float64Array) -> None:
        """Take the next pulses."""
        self._times = np.append(self._times, times)
        self.count += times.size

    def forget_before(self, number: int) -> None:
        """Drop earlier pulses but for those that still bear on the spline."""
        first = min(number, self.count - 1) - GUARD
        if first > self.first:
            self._times = self._times[first - self.first :]
            self.first = first

    def spline(self) -> Float64Array:
        """Cubics of time, ``(4, intervals)``, of the place from each pulse to the next; not-a-knot at the ends."""
        from scipy.interpolate import CubicSpline

        return np.ascontiguousarray(CubicSpline(np.arange(self._times.size), self._times).c)

    def check_forwards(self, spline: Float64Array, start: float, stop: float) -> None:
        """Refuse a spline that runs backwards between two places, as it does about a missing pulse."""
        first = int(start) - self.first
        self._check_even(first, int(np.ceil(stop)) - self.first)
        slopes = _least_slope(spline[:, first : int(np.ceil(stop)) - self.first])
        if np.any(slopes <= 0):
            worst = self._times[first + int(np.argmin(slopes))]
            raise NotApplicableError(
                f"{self._owner}: pulse_times are so uneven near {worst:g} s that the spline through them runs"
                " backwards; a pulse is missing or false there, leave out that part of the record"
            )

    def _check_even(self, first: int, last: int) -> None:
        """Refuse an interval that stands out from both its neighbours, as those about a missing or false pulse do."""
        d = np.diff(self._times[max(first - 2, 0) : last + 3])
        if d.size < 4:
            return
        long = np.append(False, np.append(d[1:-1] > _OUTSTANDING * np.maximum(d[:-2], d[2:]), False))
        short = np.append(False, np.append(_OUTSTANDING * d[1:-1] < np.minimum(d[:-2], d[2:]), False))
        halves = d[1:-2] + d[2:-1] < np.minimum(d[:-3], d[3:]) * (2 / _OUTSTANDING)
        odd = np.flatnonzero(long | short | np.concatenate([[False], halves, [False, False]]))
        if odd.size:
            where = self._times[max(first - 2, 0) + odd[0]]
            raise NotApplicableError(
                f"{self._owner}: an interval of pulse_times about {where:g} s stands out from its neighbours; a pulse"
                " is missing or false there, mend it or leave out that part of the record"
            )

    def times(self, spline: Float64Array, places: Float64Array) -> Float64Array:
        """Times at places of the pulses' count, s."""
        p = places - self.first
        i = np.clip(p.astype(np.int64), 0, spline.shape[1] - 1)
        w = p - i
        c = spline[:, i]
        return ((c[0] * w + c[1]) * w + c[2]) * w + c[3]


_OUTSTANDING = 1.6
"""Ratio of an interval to both neighbours at which a pulse must be missing; 2 where one is."""


def _least_slope(c: Float64Array) -> Float64Array:
    """Smallest derivative of each cubic between 0 and 1."""
    a, b, slope = 3 * c[0], 2 * c[1], c[2]
    turn = np.clip(np.divide(-b, 2 * a, out=np.zeros_like(a), where=a != 0), 0, 1)
    return np.minimum.reduce([slope, (a * turn + b) * turn + slope, a + b + slope])
