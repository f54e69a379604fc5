"""The samples of a record that comes in blocks."""

import numpy as np

from sigdb.signature._linear_prediction import MEMORY, predicted
from sigdb.signature._validation import Float64Array


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
        """Samples start up to stop; beyond either end of the record, its linear prediction."""
        inside = self._kept[:, max(start, 0) - self._first : min(stop, self.count) - self._first]
        parts = [inside]
        if start < 0:
            parts.insert(0, predicted(self._head[:, ::-1], -start)[:, ::-1])
        if stop > self.count:
            parts.append(predicted(self._kept, stop - self.count))
        return np.ascontiguousarray(np.concatenate(parts, axis=1) if len(parts) > 1 else inside)
