"""Threads for the training of trees."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def idle_cores() -> Iterator[int]:
    """Limit OpenMP, which trains trees, to the cores that other processes leave idle; yield their number.

    Where the system does not tell its load, half of the cores are used.
    """
    cores = os.cpu_count() or 1
    # The load counts this process too.
    load = getattr(os, "getloadavg", None)
    idle = cores - round(load()[0]) + 1 if load else cores // 2
    threads = min(max(idle, 1), cores)
    with threadpool_limits(threads, user_api="openmp"):
        yield threads
