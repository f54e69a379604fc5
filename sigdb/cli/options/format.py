"""The option ``--format``, and JSON as it is printed."""

from collections.abc import Callable
from typing import Any, TypeVar

import click

_Command = TypeVar("_Command", bound=Callable[..., Any])


def format_option(*formats: str, of: str = "the output") -> Callable[[_Command], _Command]:
    """Return the option ``--format``, whose value a command gets as ``form``.

    Parameters
    ----------
    *formats
        The formats, the default first.
    of
        The formatted thing, for the help.
    """
    return click.option(
        "--format",
        "form",
        type=click.Choice(formats),
        default=formats[0],
        show_default=True,
        help=f"Format of {of}.",
    )


def echo_json(value: object, *, indent: int | None = 1) -> None:
    """Print a value as JSON, in which a number that is not finite is null."""
    from sigdb.core import json_text

    click.echo(json_text(value, indent=indent), nl=False)
