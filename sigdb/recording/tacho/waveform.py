"""The waveform of a tacho, in memory or in blocks, and levels of its low and high state."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import FloatArray, IntArray

WINDOWS = (16, 64, 256, 1024)
"""Numbers of windows of the record in which levels are taken, from few to many."""
_LEAST_WINDOW = 16
"""Fewest samples of a window."""
_NEIGHBOURS = 5
"""Windows whose median gives a level: a spike is in two of them at most."""
_FLAT = 0.1
"""Range of a window, relative to the median range, below which the tacho stands still there."""
_BINS = 2**19
"""Bins of the range, and of each bin, in which percentiles of a waveform in blocks are found."""


@dataclass(frozen=True, kw_only=True)
class Levels:
    """Low and high state of a waveform: a number each, or numbers at the centres of windows.

    Attributes
    ----------
    low, high
        Levels, () or (windows,).
    centres
        (windows,) samples in the middle of the windows; None for single numbers.
    """

    low: FloatArray
    high: FloatArray
    centres: FloatArray | None = None

    def at(self, first: int, size: int) -> tuple[FloatArray, FloatArray]:
        """Return the levels for samples from a first one on: straight lines between the centres."""
        if self.centres is None:
            return self.low, self.high
        samples = np.arange(first, first + size)
        return np.interp(samples, self.centres, self.low), np.interp(samples, self.centres, self.high)


@dataclass(frozen=True)
class Waveform:
    """A waveform that comes in blocks, as often as it is needed.

    Attributes
    ----------
    blocks
        Function that yields the consecutive blocks of samples.
    size
        Number of all samples.
    least, greatest
        Least and greatest sample.
    in_memory
        Whether it is a single block in memory.
    """

    blocks: Callable[[], Iterable[FloatArray]]
    size: int
    least: float
    greatest: float
    in_memory: bool = False

    @classmethod
    def of(cls, x: FloatArray) -> "Waveform":
        """Return the waveform of samples in memory."""
        return cls(lambda: (x,), len(x), float(np.min(x)), float(np.max(x)), in_memory=True)

    def numbered(self) -> Iterator[tuple[int, FloatArray]]:
        """Yield the number of the first sample of each block, and its samples."""
        first = 0
        for x in self.blocks():
            yield first, x
            first += len(x)

    def levels(self) -> Iterator[tuple[Levels, int]]:
        """Yield levels to try, and the windows that need two pulses each: extremes, percentiles, moving levels."""
        yield Levels(low=np.array(self.least), high=np.array(self.greatest)), 0
        for percent in (0.5, 5.0):
            low, high = self.percentiles(percent, 100 - percent)
            if high > low:
                yield Levels(low=np.array(low), high=np.array(high)), 0
        for count in WINDOWS:
            if self.size >= count * _LEAST_WINDOW:
                yield self._window_levels(count), count

    def usual_range(self) -> float:
        """Return the median range of sixteen windows, which a spike does not widen."""
        whole = self.greatest - self.least
        if self.size < WINDOWS[0] * _LEAST_WINDOW:
            return whole
        low, high = self._extremes[WINDOWS[0]]
        return float(np.median(high - low)) or whole

    def percentiles(self, *percents: float) -> tuple[float, ...]:
        """Return percentiles, with straight lines between the sorted samples."""
        if self.in_memory:
            return tuple(float(value) for value in np.percentile(next(iter(self.blocks())), percents))
        ranks = np.array(percents) / 100 * (self.size - 1)
        below = np.floor(ranks).astype(np.int64)
        values = [
            np.array([self._sorted(int(rank)) for rank in each])
            for each in (below, np.minimum(below + 1, self.size - 1))
        ]
        return tuple(float(value) for value in values[0] + (ranks - below) * (values[1] - values[0]))

    def _sorted(self, rank: int) -> float:
        """Return the sample of a rank, to 4e-12 of the range: the bin of a bin that holds it."""
        coarse = int(np.searchsorted(self._coarse, rank, "right"))
        before = int(self._coarse[coarse - 1]) if coarse else 0
        if coarse not in self._fine:
            self._fine[coarse] = np.cumsum(self._histogram(coarse))
        fine = int(np.searchsorted(self._fine[coarse], rank - before, "right"))
        if (coarse, fine) == (_BINS - 1, _BINS - 1):
            return self.greatest
        place = (coarse + fine / _BINS) / _BINS
        return self.least + place * (self.greatest - self.least)

    @cached_property
    def _coarse(self) -> IntArray:
        return np.cumsum(self._histogram())

    @cached_property
    def _fine(self) -> dict[int, IntArray]:
        return {}

    def _histogram(self, bin_: int | None = None) -> IntArray:
        """Return the numbers of samples in equal parts of the range, or of one of these."""
        counts = np.zeros(_BINS, np.int64)
        scale = _BINS / ((self.greatest - self.least) or 1.0)
        for x in self.blocks():
            places = np.minimum((x - self.least) * scale, np.nextafter(_BINS, 0))
            if bin_ is not None:
                places = (places[places.astype(np.int64) == bin_] - bin_) * _BINS
            counts += np.bincount(places.astype(np.int64), minlength=_BINS)
        return counts

    @cached_property
    def _extremes(self) -> dict[int, tuple[FloatArray, FloatArray]]:
        """Least and greatest sample of each window, by the number of windows."""
        counts = [count for count in WINDOWS if self.size >= count * _LEAST_WINDOW]
        edges = {count: _edges(self.size, count) for count in counts}
        extremes = {count: (np.full(count, np.inf), np.full(count, -np.inf)) for count in counts}
        for first, x in self.numbered():
            for count in counts:
                begin = int(np.searchsorted(edges[count], first, "right")) - 1
                end = int(np.searchsorted(edges[count], first + len(x), "left"))
                starts = np.maximum(edges[count][begin:end] - first, 0)
                low, high = (values[begin:end] for values in extremes[count])
                np.minimum(low, np.minimum.reduceat(x, starts), out=low)
                np.maximum(high, np.maximum.reduceat(x, starts), out=high)
        return extremes

    def _window_levels(self, count: int) -> Levels:
        """Return levels from the extremes of windows: their median over neighbours."""
        from scipy.ndimage import median_filter

        low, high = (median_filter(values, _NEIGHBOURS, mode="nearest") for values in self._extremes[count])
        usual = float(np.median(high - low))
        # A tacho that stands still makes no pulses of its noise.
        high = np.where(high - low > _FLAT * usual, high, low + 2 * usual)
        return Levels(low=low, high=high, centres=_edges(self.size, count) + self.size / count / 2)


def _edges(size: int, count: int) -> FloatArray:
    """Return the first sample of each window."""
    return np.asarray(np.linspace(0, size, count + 1).astype(int)[:-1])
