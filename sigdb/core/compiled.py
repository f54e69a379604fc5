"""Numba kernels: cached on disk, GIL released; a compilation is logged.

Importing this module imports numba, and changes no state outside of it.
"""

import logging
from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event

_Function = TypeVar("_Function", bound=Callable[..., Any])

_logger = logging.getLogger("sigdb")
_logger.addHandler(logging.NullHandler())


def kernel(function: _Function) -> _Function:
    """Compile a function on its first use.

    The machine code is kept on disk, so that a machine compiles each kernel once. Where no directory can be written,
    each process compiles it. A compilation is logged by the logger ``sigdb`` at level INFO. Sums may be reordered,
    always in the same way; nan and inf are respected.

    Parameters
    ----------
    function : callable
        A function that numba can compile without Python objects.

    Returns
    -------
    callable
        The compiled function, which takes the same arguments and releases the GIL.
    """
    options: dict[str, Any] = {"nogil": True, "fastmath": {"reassoc", "contract", "nsz", "arcp"}}
    try:
        dispatcher: Any = njit(cache=True, **options)(function)
    except RuntimeError:  # neither the installation nor the user's cache directory can be written
        dispatcher = njit(**options)(function)
    if hasattr(dispatcher, "compile"):  # not where numba is switched off
        dispatcher.compile = _logged(dispatcher, dispatcher.compile)
    return cast(_Function, dispatcher)


def _logged(dispatcher: object, compile_: Callable[[object], object]) -> Callable[[object], object]:
    """Compile for a signature, and log it unless the machine code was on disk."""

    def compile_logged(signature: object) -> object:
        with event.install_listener("numba:compile", _Announcement(dispatcher)):
            return compile_(signature)

    return compile_logged


class _Announcement(event.Listener):
    """Logs that a kernel begins to compile."""

    def __init__(self, dispatcher: object) -> None:
        self._dispatcher = dispatcher

    def on_start(self, event: event.Event) -> None:
        compiles, text = event.data["dispatcher"], "compiling %s for this machine; done once, it takes some seconds"
        if compiles == self._dispatcher:
            _logger.info(text, compiles.py_func.__qualname__)

    def on_end(self, event: event.Event) -> None:
        pass
