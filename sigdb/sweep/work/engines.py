"""Engines, which make the parts of a plan: processes here, or a Dask cluster. They return receipts, never arrays."""

import multiprocessing
import signal
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError
from threadpoolctl import threadpool_limits

from sigdb.core import DatabaseError, InputError
from sigdb.database import Receipt, Store
from sigdb.sweep.plan.plan import Plan

Make = Callable[[Plan, Store, int], Receipt]


class WorkerDiedError(Exception):
    """A worker died, and its part is not finished."""


class Engine(Protocol):
    """Makes parts in parallel."""

    def receipts(self, make: Make, plan: Plan, store: Store, parts: Sequence[int]) -> Iterator[Receipt]:
        """Yield receipts as parts are finished.

        Raises
        ------
        WorkerDiedError
            If a worker died; the caller requests the missing parts again.
        """


@dataclass(frozen=True)
class Processes:
    """Worker processes on this machine: ``jobs`` of them, -1 for one on each core."""

    jobs: int = -1

    def receipts(self, make: Make, plan: Plan, store: Store, parts: Sequence[int]) -> Iterator[Receipt]:
        """Yield receipts as parts are finished."""
        cores = joblib.cpu_count()
        # No more workers than cores unless there are parts for them.
        jobs = self.jobs if self.jobs <= cores else max(cores, min(self.jobs, len(parts)))
        pool = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="n_jobs")
        with joblib.parallel_config("loky", inner_max_num_threads=1), warnings.catch_warnings():
            # A worker that has grown is replaced between two parts. Nothing is lost.
            warnings.filterwarnings("ignore", message="A worker stopped while some jobs were given")
            try:
                yield from pool(joblib.delayed(_make_in_process)(make, plan, store, part) for part in parts)
            except TerminatedWorkerError:
                raise WorkerDiedError from None


@dataclass(frozen=True)
class Cluster:
    """The workers of a Dask cluster whose scheduler has this address; they must see the database's place too."""

    scheduler: str

    def receipts(self, make: Make, plan: Plan, store: Store, parts: Sequence[int]) -> Iterator[Receipt]:
        """Yield receipts as parts are finished; the scheduler gives a dead worker's parts to others."""
        distributed = _distributed()
        with self._client() as client:
            workers = client.nthreads()
            if not workers:
                raise DatabaseError(
                    f"scheduler {self.scheduler} has no workers; start some: dask worker {self.scheduler}"
                )
            # A task, not scattered data: it is computed again when the worker that holds it dies.
            waiting, shared = list(reversed(parts)), client.submit(_identity, plan, pure=False)

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


def _identity(plan: Plan) -> Plan:
    return plan


def _make_in_process(make: Make, plan: Plan, store: Store, part: int) -> Receipt:
    """Make a part in a worker that ignores Ctrl-C: it reaches the whole group, and the parent ends its workers."""
    if multiprocessing.current_process().name != "MainProcess":
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return _make(make, plan, store, part)


def _make(make: Make, plan: Plan, store: Store, part: int) -> Receipt:
    """Make a part with one thread in linear algebra: the same sums in the same order everywhere, bit for bit."""
    with threadpool_limits(1):
        return make(plan, store, part)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError("--scheduler needs distributed, which is not installed: pip install distributed") from None
    return distributed
