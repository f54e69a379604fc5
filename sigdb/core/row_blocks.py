"""Blocks of long work: so many rows at once that their arrays stay in the cache or in memory."""

from collections.abc import Iterator

SIGNALS_AT_ONCE = 32
"""Signals computed together: their intermediate arrays stay in the cache of a core, whatever the batch."""


def blocks(count: int, size: int) -> Iterator[slice]:
    """Yield the slices of consecutive blocks of a size; the last one may be shorter.

    Examples
    --------
    >>> from sigdb.core.row_blocks import blocks
    >>> list(blocks(5, 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    for first in range(0, count, size):
        yield slice(first, min(first + size, count))
