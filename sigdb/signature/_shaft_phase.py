"""Time against the angle of a shaft, a cubic spline through the pulses of its tacho."""

import numpy as np

from sigdb.signature._validation import Float64Array

GUARD = 32
"""A pulse this many intervals away moves the spline by 0.27^32, less than rounding."""


class ShaftPhase:
    """Pulse times by their number; those that no longer matter may be forgotten."""

    def __init__(self) -> None:
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

    def times(self, spline: Float64Array, places: Float64Array) -> Float64Array:
        """Times at places of the pulses' count, s."""
        p = places - self.first
        i = np.clip(p.astype(np.int64), 0, spline.shape[1] - 1)
        w = p - i
        c = spline[:, i]
        return ((c[0] * w + c[1]) * w + c[2]) * w + c[3]
