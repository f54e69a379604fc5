"""The options that say who does the work."""

from typing import Any

import click


def _checked(context: click.Context, parameter: click.Parameter, jobs: int) -> int:
    if jobs == 0 or jobs < -1:
        raise click.BadParameter(f"{jobs}; give 1 or more, or -1 for one on each core")
    return jobs


def jobs_option(command: Any) -> Any:
    """``--jobs``."""
    said = "Worker processes; -1 for one on each core."
    return click.option("--jobs", type=int, default=-1, show_default=True, callback=_checked, help=said)(command)


def scheduler_option(command: Any) -> Any:
    """``--scheduler``."""
    said = "Let the workers of this Dask scheduler do the work."
    return click.option("--scheduler", metavar="ADDRESS", help=said)(command)
