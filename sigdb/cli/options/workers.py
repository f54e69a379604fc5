"""The options that say which processes do the work."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from sigdb.sweep import Job

_Command = TypeVar("_Command", bound=Callable[..., Any])


_MOST_JOBS = 1024


def _checked(context: click.Context, parameter: click.Parameter, jobs: int) -> int:
    if jobs == 0 or jobs < -1:
        raise click.BadParameter(f"{jobs}; give 1 or more, or -1 for one on each core")
    if jobs > _MOST_JOBS:
        raise click.BadParameter(f"{jobs}; at most {_MOST_JOBS} processes are started, -1 for one on each core")
    return jobs


def jobs_option(command: _Command) -> _Command:
    """Add ``--jobs`` to a command."""
    text = "Worker processes; -1 for one on each core."
    return click.option("--jobs", type=int, default=-1, show_default=True, callback=_checked, help=text)(command)


def scheduler_option(command: _Command) -> _Command:
    """Add ``--scheduler`` to a command."""
    text = "Use the workers of this Dask scheduler."
    return click.option("--scheduler", metavar="ADDRESS", help=text)(command)


def _job(context: click.Context, parameter: click.Parameter, text: str | None) -> "Job | None":
    from sigdb.sweep import Job

    return None if text is None else Job.from_text(text)


def job_option(command: _Command) -> _Command:
    """Add ``--job`` to a command."""
    text = "Make the share of job I of N, which may run at once on machines that share the place of the database."
    return click.option("--job", metavar="I/N", callback=_job, help=text)(command)
