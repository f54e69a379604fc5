"""Long work: its blocks, its progress, and the functions that are called with it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

SIGNALS_AT_ONCE = 32
"""Signals computed together: their intermediate arrays stay in the cache of a core, whatever the batch."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """The number of finished items. An item that is only dispatched does not count.

    Attributes
    ----------
    stage
        Name of the items, for example ``templates`` or ``rows``.
    done, total
        Numbers of finished items and of all items.
    before
        Number of items that were finished when this run began.
    """

    stage: str
    done: int
    total: int
    before: int


OnProgress = Callable[[Progress], object]
"""Called with the progress of long work."""

OnStep = Callable[[str], object]
"""Called with the name of each step, or a sentence about it, before the step begins."""


def ignore(_: object) -> None:
    """Do nothing with a progress or a step: the default of ``on_progress`` and ``on_step``."""


def blocks(count: int, size: int) -> Iterator[slice]:
    """Yield the slices of consecutive blocks of a size; the last one may be shorter.

    Examples
    --------
    >>> from sigdb.core import blocks
    >>> list(blocks(5, 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    for first in range(0, count, size):
        yield slice(first, min(first + size, count))
