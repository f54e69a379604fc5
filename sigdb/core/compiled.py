"""Compiled kernels: cached on disk, without the interpreter's lock, and said when they compile.

Importing this module imports numba.
"""

import logging
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event

_Function = TypeVar("_Function", bound=Callable[..., Any])

logger = logging.getLogger("sigdb")


class _Announcement(event.Listener):
    """Says which kernel compiles: it is done once, then kept on disk for this machine."""

    def on_start(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        if function.__module__.startswith("sigdb."):
            logger.info("compiling %s for this machine; done once, it takes some seconds", function.__qualname__)

    def on_end(self, event: event.Event) -> None:
        pass


if not logger.handlers:
    _handler = logging.StreamHandler()
    _handler.setFormatter(logging.Formatter("sigdb: %(message)s"))
    logger.addHandler(_handler)
    logger.setLevel(logging.INFO)
event.register("numba:compile", _Announcement())


def kernel(function: _Function) -> _Function:
    """Compile a function on its first use. Sums may be reordered, always in the same way; nan and inf keep theirs."""
    compiled: Any = njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz", "arcp"})(function)
    return cast(_Function, compiled)
