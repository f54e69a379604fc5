"""Progress of long work, and the functions that are called with it."""

from collections.abc import Callable
from dataclasses import dataclass


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
