"""One thread for linear algebra of small matrices."""

from collections.abc import Callable
from contextvars import ContextVar
from functools import cache, wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")
_LIMITED: ContextVar[bool] = ContextVar("_LIMITED", default=False)
"""Whether a function that is running has set one thread already."""


def small_matrices(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Let a function use one thread for linear algebra.

    Threads that share a small matrix mostly wait for each other, on a busy machine for a long time.

    Parameters
    ----------
    function : callable
        A function that solves many small systems.

    Returns
    -------
    callable
        The same function; the number of threads is as before when it returns.
    """

    @wraps(function)
    def alone(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        if _LIMITED.get():
            return function(*args, **kwargs)
        with _libraries().limit(limits=1, user_api="blas"):
            token = _LIMITED.set(True)
            try:
                return function(*args, **kwargs)
            finally:
                _LIMITED.reset(token)

    return alone


@cache
def _libraries() -> ThreadpoolController:
    """Return the libraries of linear algebra: finding them takes milliseconds, and the first call has imported them."""
    return ThreadpoolController()
