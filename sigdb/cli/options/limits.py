"""Options of the limits of a query."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import click

from sigdb.cli.options.quantities import Quantity
from sigdb.database import QueryLimits

_USUAL = QueryLimits()

_OPTIONS = {
    "max_seconds": ("Greatest time of the query, s.", Quantity("s", min=0, min_open=True), _USUAL.max_seconds),
    "max_memory_gb": (
        "Greatest memory of the query, GB; nothing is written to a disk in its place.",
        click.FloatRange(0, min_open=True),
        _USUAL.max_memory_gb,
    ),
    "max_rows": ("Greatest number of rows of the result.", click.IntRange(1), _USUAL.max_rows),
}


def limit_options(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return options of the limits of a query, whose values a command gets as the dictionary ``limits``.

    Parameters
    ----------
    *names
        ``max_seconds``, ``max_memory_gb`` and ``max_rows``.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def call(**options: Any) -> None:
            command(limits={name: options.pop(name) for name in names}, **options)

        for name in reversed(names):
            text, kind, usual = _OPTIONS[name]
            option = click.option(f"--{name.replace('_', '-')}", type=kind, default=usual, show_default=True, help=text)
            call = option(call)
        return call

    return decorate
