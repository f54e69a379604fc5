"""Limits of time, memory and rows of a query, and a call that is interrupted at them."""

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import TypedDict, TypeVar

from sigdb.core import InputError

_T = TypeVar("_T")

_SECONDS_TO_CTRL_C = 0.1
"""Greatest time until a running query takes notice of its limit of time and of Ctrl-C."""


class LimitOptions(TypedDict, total=False):
    """Limits of a query as keyword arguments.

    Attributes
    ----------
    max_seconds : float
        Greatest time of a query, s.
    max_memory_gb : float
        Greatest memory of a query, and of its result, GB. Nothing is written to a disk in its place.
    max_rows : int
        Greatest number of rows of the result.
    """

    max_seconds: float
    max_memory_gb: float
    max_rows: int


@dataclass(frozen=True, kw_only=True)
class QueryLimits:
    """Limits of a query; see :class:`LimitOptions`."""

    max_seconds: float = 600.0
    max_memory_gb: float = 4.0
    max_rows: int = 10_000_000

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
                raise InputError(f"{name} = {value!r} must be a number above 0")
        if not math.isfinite(self.max_memory_gb):
            raise InputError(f"max_memory_gb = {self.max_memory_gb!r} must be finite")

    def exceeded(self, limit: str) -> InputError:
        """Return the error of a query that reached a limit: ``max_seconds``, ``max_memory_gb`` or ``max_rows``."""
        value = f"{getattr(self, limit):g}" if limit != "max_rows" else str(self.max_rows)
        what = {
            "max_seconds": f"was stopped after {value} s",
            "max_memory_gb": f"needs more memory than {value} GB",
            "max_rows": f"has more rows than {value}",
        }[limit]
        option = f"--{limit.replace('_', '-')}"
        return InputError(f"query: {what}, which is its limit; ask for less, or raise {limit} ({option})")


DEFAULT_LIMITS = QueryLimits()


class TimedCalls:
    """Calls in a thread of their own, which share a time; an interrupt ends a call at the limit or at Ctrl-C.

    Parameters
    ----------
    seconds
        Time of all calls together.
    interrupt
        Ends the running call with an error.
    """

    def __init__(self, seconds: float, interrupt: Callable[[], object]) -> None:
        self._left, self._interrupt = seconds, interrupt
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="sigdb-query")
        self.out_of_time = False

    def run(self, call: Callable[[], _T]) -> _T:
        """Return the result of a call, or raise its error."""
        started = time.monotonic()
        future = self._thread.submit(call)
        try:
            while not wait([future], timeout=_SECONDS_TO_CTRL_C).done:
                if time.monotonic() - started >= self._left:
                    self.out_of_time = True
                    self._interrupt()
                    break
            return future.result()
        except KeyboardInterrupt:
            self._interrupt()
            wait([future])
            raise
        finally:
            self._left -= time.monotonic() - started

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown()
