"""The samples of a record that comes in blocks."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sigdb.signature.checks import Float64Array

MEMORY = 256
"""Samples that a prediction is made from."""

_ORDER = 32


def predict(x: Float64Array, count: int) -> Float64Array:
    """Continue x, ``(channels, samples)``, by ``(channels, count)`` samples; exact for up to 16 steady tones."""
    return np.array([_continue(channel[-MEMORY:], count) for channel in x]).reshape(len(x), count)


def _continue(x: Float64Array, count: int) -> Float64Array:
    order = min(_ORDER, x.size // 4)
    if order == 0 or count == 0:
        return np.full(count, x[-1])
    rows = sliding_window_view(x, order + 1)
    # Forwards and backwards: a tone obeys the same recurrence in both directions, and noise is predicted tamely.
    before, after = np.concatenate([rows[:, :-1], rows[:, :0:-1]]), np.concatenate([rows[:, -1], rows[:, 0]])
    weights = np.linalg.lstsq(before, after, rcond=None)[0]
    most = 2 * np.abs(x).max()
    series = np.append(x[-order:], np.empty(count))
    for i in range(order, order + count):
        series[i] = min(max(weights @ series[i - order : i], -most), most)
    return series[order:]


class Record:
    """Samples by their number in the record, ``(channels, samples)``; those long used may be forgotten."""

    def __init__(self) -> None:
        self.count = 0
        self._first = 0
        self._head: Float64Array = np.empty((0, 0))
        self._kept: Float64Array = np.empty((0, 0))

    def append(self, block: Float64Array) -> None:
        """Take the next samples."""
        self._kept = block if self.count == 0 else np.concatenate([self._kept, block], axis=1)
        self.count += block.shape[1]
        if self._first == 0:
            self._head = self._kept[:, :MEMORY].copy()

    def forget_before(self, number: int) -> None:
        """Drop earlier samples, but not those that the end is predicted from."""
        first = min(number, self.count - MEMORY)
        if first > self._first:
            self._kept = self._kept[:, first - self._first :].copy()
            self._first = first

    def window(self, start: int, stop: int) -> Float64Array:
        """Return the samples start up to stop; beyond either end of the record, its linear prediction."""
        inside = self._kept[:, max(start, 0) - self._first : min(stop, self.count) - self._first]
        parts = [inside]
        if start < 0:
            parts.insert(0, predict(self._head[:, ::-1], -start)[:, ::-1])
        if stop > self.count:
            parts.append(predict(self._kept, stop - self.count))
        return np.ascontiguousarray(np.concatenate(parts, axis=1) if len(parts) > 1 else inside)
