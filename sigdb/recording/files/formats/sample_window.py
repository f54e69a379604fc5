"""Windows of samples: the same part of every series of a file that is read in blocks."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from sigdb.recording.files.formats.contents import SHORTEST_BLOCK, Contents, block_length


@dataclass(frozen=True)
class SampleWindow:
    """Consecutive samples of each series of a file.

    Attributes
    ----------
    first
        Number of the first sample.
    length
        Number of samples. If fewer than 256 would follow them, they are part of the window.
    """

    first: int
    length: int

    def of(self, total: int) -> slice:
        """Return the samples of a series of ``total`` that lie in the window.

        Examples
        --------
        >>> SampleWindow(1000, 1000).of(5000), SampleWindow(1000, 1000).of(2100), SampleWindow(2000, 1000).of(2100)
        (slice(1000, 2000, None), slice(1000, 2100, None), slice(2100, 2100, None))
        """
        stop = self.first + self.length
        stop = total if total - stop < SHORTEST_BLOCK else stop
        is_past = self.first and total - self.first < SHORTEST_BLOCK
        return slice(total if is_past else self.first, stop)

    def count(self, total: int) -> int:
        """Return how many samples of a series of ``total`` lie in the window."""
        part = self.of(total)
        return int(part.stop - part.start)

    def axis(self, shape: tuple[int, ...]) -> int:
        """Return the axis of an array along which its samples run: the longest, the first of several."""
        return shape.index(max(shape)) if shape else 0

    def shape(self, shape: tuple[int, ...], axis: int) -> tuple[int, ...]:
        """Return the shape of the part of an array that lies in the window."""
        return (*shape[:axis], self.count(shape[axis]), *shape[axis + 1 :]) if shape else ()

    def index(self, shape: tuple[int, ...], axis: int) -> tuple[slice, ...]:
        """Return the index of that part."""
        return tuple(self.of(size) if i == axis else slice(None) for i, size in enumerate(shape))


WHOLE = SampleWindow(0, sys.maxsize)
"""The window of all samples."""


def window_blocks(
    read: Callable[[SampleWindow], Contents], samples: int | None, *, starts_of_file: bool = True
) -> Iterator[Contents]:
    """Yield the contents of consecutive windows up to the end of the longest series.

    Parameters
    ----------
    read
        Returns the contents of a window.
    samples
        Samples of a window; by default so many that all columns fill a block.
    starts_of_file
        Whether the starts of its columns are those of the file.
    """
    columns = read(SampleWindow(0, 0)).columns
    window = SampleWindow(0, block_length(len(columns), samples))
    while True:
        contents = read(window)
        if window.first and not any(column.values.size for column in contents.columns):
            return
        yield replace(contents, starts_of_file=starts_of_file)
        window = replace(window, first=window.first + window.length)
