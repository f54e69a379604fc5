"""Rates of reading rows, by the time that passed and by processor time."""

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

BATCH, RUNS = 256, 3


@dataclass(frozen=True, kw_only=True)
class Rate:
    """One way to read rows: how many, in which time and processor time, s."""

    what: str
    by: str
    rows: int
    seconds: float
    processor_seconds: float

    def shown(self, aim: int | None) -> dict[str, Any]:
        """A line of the table."""
        return {
            "what": self.what,
            "by": self.by,
            "rows": self.rows,
            "rows_a_second": round(self.rows / self.seconds),
            "rows_a_processor_second": round(self.rows / self.processor_seconds),
            "aim": aim,
        }


def rate(what: str, by: str, rows: int, call: Callable[[], Any], *, before: Callable[[], None] | None = None) -> Rate:
    """Return the rate of the fastest of some runs after a first one; of a single run where something goes before it."""
    if before is None:
        call()
    else:
        before()
    runs = []
    for _ in range(RUNS if before is None else 1):
        started, processor = time.perf_counter(), time.process_time()
        call()
        runs.append((time.perf_counter() - started, time.process_time() - processor))
    seconds, processor = (min(run[i] for run in runs) for i in (0, 1))
    return Rate(what=what, by=by, rows=rows, seconds=seconds, processor_seconds=processor)


def drop_pages(files: Sequence[Path]) -> Callable[[], None]:
    """Return a call that writes the pages of files to the disk and drops them from memory."""

    def drop() -> None:
        for file in files:
            descriptor = os.open(file, os.O_RDONLY)
            os.fsync(descriptor)
            os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
            os.close(descriptor)

    return drop


def shuffled(rows: int) -> list[NDArray[np.int64]]:
    """Places of all rows in random order, batch by batch."""
    order = np.random.default_rng(1).permutation(rows)
    return [order[first : first + BATCH] for first in range(0, rows, BATCH)]
