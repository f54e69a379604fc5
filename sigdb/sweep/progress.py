"""What a long work has finished."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Progress:
    """What is finished so far; nothing counts when it is only dispatched.

    Attributes
    ----------
    stage
        What is counted, for example ``templates`` or ``rows``.
    done, total
        How many of them.
    before
        Those that were already there when this run began.
    """

    stage: str
    done: int
    total: int
    before: int
