"""Engines, which make parts of databases: processes here, or a Dask cluster. They return receipts, never arrays."""

import multiprocessing
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, TypeVar

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError
from threadpoolctl import ThreadpoolController

from sigdb.core import DatabaseError, InputError
from sigdb.database import Receipt, Store

_Work = TypeVar("_Work")
Make = Callable[[_Work, Store, int], Receipt]
"""Makes a part, given the work that all parts share: a plan, or a function that adds features."""

_WORKER_DEATHS = 3
"""Successive deaths of a worker, with no part finished in between, after which the run gives up."""

_IDLE_SECONDS = 10
"""Seconds without work after which a worker process ends, and gives back its memory."""


class WorkerDiedError(Exception):
    """A worker died, and its part is not finished."""


class Engine(Protocol):
    """Makes parts in parallel."""

    def receipts(self, make: Make[_Work], work: _Work, store: Store, parts: Sequence[int]) -> Iterator[Receipt]:
        """Yield receipts as parts are finished.

        Raises
        ------
        WorkerDiedError
            If a worker died; the caller requests the missing parts again.
        """


def make_missing(
    engine: Engine,
    make: Make[_Work],
    work: _Work,
    store: Store,
    *,
    numbers: Sequence[int],
    finished: dict[int, int],
    recount: Callable[[], dict[int, int]],
    report: Callable[[], object],
    total: str,
) -> None:
    """Make parts until none is missing; a worker that dies costs its part only.

    Parameters
    ----------
    engine
        Engine.
    make, work, store
        As in :meth:`Engine.receipts`.
    numbers
        Parts that are to exist.
    finished
        Number of rows by finished part; new parts are added.
    recount
        Returns the same as it is in the store, where a dead worker may have finished parts.
    report
        Called when a part is finished.
    total
        Number and name of the rows, for messages.

    Raises
    ------
    DatabaseError
        If workers keep dying.
    """
    deaths = 0
    while missing := [part for part in numbers if part not in finished]:
        try:
            for receipt in engine.receipts(make, work, store, missing):
                finished[receipt.part] = receipt.rows
                deaths = 0
                report()
        except WorkerDiedError:
            deaths += 1
            finished |= recount()
            if deaths >= _WORKER_DEATHS:
                raise DatabaseError(
                    f"{store}: worker processes keep dying (out of memory?); {sum(finished.values())} of {total} are "
                    "kept; run the same command with fewer --jobs"
                ) from None


@dataclass(frozen=True)
class Processes:
    """Worker processes on this machine: ``jobs`` of them, -1 for one on each core."""

    jobs: int = -1

    def receipts(self, make: Make[_Work], work: _Work, store: Store, parts: Sequence[int]) -> Iterator[Receipt]:
        """Yield receipts as parts are finished."""
        cores = joblib.cpu_count()
        # No more workers than cores unless there are parts for them.
        jobs = self.jobs if self.jobs <= cores else max(cores, min(self.jobs, len(parts)))
        pool = joblib.Parallel(
            n_jobs=jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="n_jobs",
            idle_worker_timeout=_IDLE_SECONDS,
        )  # fmt: skip
        with joblib.parallel_config("loky", inner_max_num_threads=1), warnings.catch_warnings():
            # A worker that has grown is replaced between two parts. Nothing is lost.
            warnings.filterwarnings("ignore", message="A worker stopped while some jobs were given")
            try:
                yield from pool(joblib.delayed(_make_in_process)(make, work, store, part) for part in parts)
            except TerminatedWorkerError:
                raise WorkerDiedError from None


@dataclass(frozen=True)
class Cluster:
    """The workers of a Dask cluster whose scheduler has this address; they must see the database's place too."""

    scheduler: str

    def receipts(self, make: Make[_Work], work: _Work, store: Store, parts: Sequence[int]) -> Iterator[Receipt]:
        """Yield receipts as parts are finished; the scheduler gives a dead worker's parts to others."""
        distributed = _distributed()
        with self._client() as client:
            workers = client.nthreads()
            if not workers:
                raise DatabaseError(
                    f"scheduler {self.scheduler} has no workers; start some: dask worker {self.scheduler}"
                )
            # A task, not scattered data: it is computed again when the worker that holds it dies.
            waiting, shared = list(reversed(parts)), client.submit(_identity, work, pure=False)

            def submit() -> Any:
                return client.submit(_make, make, shared, store, waiting.pop(), pure=False)

            # A bounded number of parts is handed out, so that neither side holds the whole sweep.
            begun = [submit() for _ in range(min(len(waiting), 2 * sum(workers.values())))]
            running = distributed.as_completed(begun)
            try:
                for future in running:
                    yield future.result()
                    if waiting:
                        running.add(submit())
            except distributed.KilledWorker:
                raise WorkerDiedError from None
            except (distributed.CancelledError, distributed.comm.CommClosedError, OSError) as error:
                raise DatabaseError(
                    f"scheduler {self.scheduler} went away ({error}); run the same command again"
                ) from None

    def _client(self) -> Any:
        try:
            return _distributed().Client(self.scheduler, timeout=5)
        except (OSError, ValueError) as error:
            raise InputError(
                f"--scheduler {self.scheduler}: no Dask scheduler answers there ({error}); start one with: "
                "dask scheduler"
            ) from None


def _identity(work: _Work) -> _Work:
    return work


def _make_in_process(make: Make[_Work], work: _Work, store: Store, part: int) -> Receipt:
    """Make a part in a worker that ignores Ctrl-C: it reaches the whole group, and the parent ends its workers."""
    if multiprocessing.current_process().name != "MainProcess":
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return _make(make, work, store, part)


def _make(make: Make[_Work], work: _Work, store: Store, part: int) -> Receipt:
    """Make a part with one thread in linear algebra: the same sums in the same order everywhere, bit for bit."""
    with _thread_pools(len(sys.modules)).limit(limits=1):
        return make(work, store, part)


@lru_cache(maxsize=1)
def _thread_pools(modules: int) -> ThreadpoolController:
    """Return the thread pools of the libraries that are loaded: searched again when there are other modules."""
    return ThreadpoolController()


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError("--scheduler needs distributed, which is not installed: pip install distributed") from None
    return distributed
