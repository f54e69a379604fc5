"""The standard streams of a command: text that steers a terminal does not reach them."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from sigdb.core import visible_text


class VisibleOutput:
    """A text stream that writes control characters of names, values and messages as visible escapes.

    Attributes
    ----------
    unchanged
        The stream itself, for progress bars.
    """

    def __init__(self, stream: TextIO, *, emphasis: bool = False) -> None:
        self.unchanged, self._emphasis = stream, emphasis

    def write(self, text: str) -> int:
        """Write a text; on a terminal, tables keep their bold heads."""
        self.unchanged.write(visible_text(text, emphasis=self._emphasis))
        return len(text)

    def writelines(self, lines: Any) -> None:
        """Write several texts."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.unchanged, name)


@contextmanager
def visible_output() -> Iterator[None]:
    """Let the standard streams write visible characters only; a closed stream of errors is replaced by none."""
    stdout, stderr = sys.stdout, sys.stderr
    errors = stderr if stderr is not None else open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115, PTH123
    sys.stdout = VisibleOutput(stdout, emphasis=stdout.isatty()) if stdout is not None else None
    sys.stderr = VisibleOutput(errors)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = stdout, stderr


def discard_output() -> None:
    """Send the rest of the output nowhere, so that Python does not complain about it when it ends."""
    with suppress(ValueError):  # a stream that is closed holds nothing
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
