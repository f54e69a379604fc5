"""Progress of a sweep: finished rows, rate and time left; a bar on a terminal, lines elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from sigdb.core import Progress as Done

_SECONDS_BETWEEN_LINES = 5.0


@contextmanager
def show_progress() -> Iterator[Callable[[Done], None]]:
    """A function that shows what is finished."""
    if sys.stderr.isatty():
        with _bar() as bar:
            yield _Bar(bar)
    else:
        yield _Lines()


def _bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        console=Console(file=getattr(sys.stderr, "unchanged", sys.stderr)),
    )


class _Rate:
    """Rate of what this run has finished, from the first report of a stage."""

    def __init__(self) -> None:
        self.stage, self.started = "", 0.0

    def per_second(self, done: Done) -> float:
        if done.stage != self.stage:
            self.stage, self.started = done.stage, time.perf_counter()
        return (done.done - done.before) / max(time.perf_counter() - self.started, 1e-9)


class _Bar:
    def __init__(self, bar: Progress) -> None:
        self.bar, self.rate = bar, _Rate()
        self.tasks: dict[str, TaskID] = {}

    def __call__(self, done: Done) -> None:
        rate = self.rate.per_second(done)
        if done.stage not in self.tasks:
            self.tasks[done.stage] = self.bar.add_task(done.stage, total=done.total, rate="")
        text = f"{rate:.0f}/s" if done.done > done.before else ""
        self.bar.update(self.tasks[done.stage], completed=done.done, total=done.total, rate=text)


class _Lines:
    def __init__(self) -> None:
        self.rate, self.last = _Rate(), 0.0

    def __call__(self, done: Done) -> None:
        rate = self.rate.per_second(done)
        now = time.perf_counter()
        if done.done < done.total and (done.done == done.before or now - self.last < _SECONDS_BETWEEN_LINES):
            return
        self.last = now
        if done.done > done.before:
            left = (done.total - done.done) / rate
            click.echo(f"{done.stage}: {done.done} of {done.total}, {rate:.0f}/s, {left:.0f} s left", err=True)
