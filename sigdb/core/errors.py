"""Errors that a user can act on.

Each message names the owner (a file, a table, a function), the field, the rule, the value and the remedy.
"""

import difflib
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

_LONGEST = 64
"""Letters of a value in a message."""
_HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_EMPHASIS = re.compile("(\x1b\\[[0-4]?m)")
_LINES = str.maketrans({"\n": "\\n", "\t": "\\t"})


def suggestion(word: str, words: Iterable[str]) -> str:
    """Return the end of a message about an unknown word: the nearest word of a list, or the whole list.

    Parameters
    ----------
    word : str
        The unknown word.
    words : iterable of str
        Words that are valid.

    Returns
    -------
    str
        Text that follows the message; empty if no word is valid.

    Examples
    --------
    >>> suggestion("teht", ["teeth", "node"])
    "; did you mean 'teeth'?"
    """
    valid = sorted(words)
    near = difflib.get_close_matches(word, valid, n=1)
    return f"; did you mean {near[0]!r}?" if near else f"; known: {', '.join(valid)}" if valid else ""


class SigdbError(Exception):
    """Base of all errors that sigdb raises for a user to act on.

    Control characters of a name or a value show as escapes.
    """

    def __str__(self) -> str:
        return visible_text(super().__str__())


class InputError(SigdbError, ValueError):
    """A file, an option or an argument breaks a stated rule."""


class NotApplicableError(InputError):
    """A method does not apply to valid input: a bound, a bank or a solver has no answer for it.

    Callers may go on without the method. They never catch :class:`InputError` for that purpose, since a wrong name
    would then look the same.
    """


class UnstableRigError(SigdbError):
    """A rig has no steady state: its response grows without bound."""


class DatabaseError(SigdbError):
    """A database cannot be read, written or continued."""


class CorruptionError(DatabaseError):
    """A file of a database is missing, or is not as it was written."""


class Problems:
    """Errors of input from independent checks, which are raised together.

    Examples
    --------
    >>> problems = Problems()
    >>> for teeth in (12, 0, -1):
    ...     with problems.collect():
    ...         if teeth < 1:
    ...             raise InputError(f"teeth = {teeth} must be 1 or more")
    >>> problems.raise_any()
    Traceback (most recent call last):
        ...
    sigdb.core.errors.InputError: teeth = 0 must be 1 or more
    teeth = -1 must be 1 or more
    """

    def __init__(self) -> None:
        self._lines: list[str] = []

    @contextmanager
    def collect(self, *, needed: bool = False) -> Iterator[None]:
        """Keep the error of a check for later, or raise it with those before, where the next checks need its result."""
        try:
            yield
        except InputError as error:
            self.add(str(error))
            if needed:
                self.raise_any()

    def add(self, text: str) -> None:
        """Keep a message, whose lines are a problem each; a repeated one counts once."""
        self._lines += [line for line in text.splitlines() if line not in self._lines]

    def raise_any(self) -> None:
        """Raise one error with a line for each problem, if there are any.

        Raises
        ------
        InputError
            If there is a problem.
        """
        if self._lines:
            raise InputError("\n".join(self._lines))


def visible_text(text: str, *, lines: bool = True, emphasis: bool = False) -> str:
    r"""Return a text in which characters that steer a terminal, or that UTF-8 does not hold, are escaped.

    Parameters
    ----------
    text : str
        Any text.
    lines : bool
        Whether ends of lines and tabs stay.
    emphasis : bool
        Whether the sequences that begin and end bold, faint, italic and underlined text stay.

    Examples
    --------
    >>> visible_text("tooth\x1b[2J 6\r")
    'tooth\\x1b[2J 6\\x0d'
    """
    parts = _EMPHASIS.split(text) if emphasis else [text]
    parts[::2] = [_HIDDEN.sub(_escape, part) for part in parts[::2]]
    visible = "".join(parts)
    return visible if lines else visible.translate(_LINES)


def shown(value: object) -> str:
    """Return the representation of a value for a message: on one line, and shortened.

    Parameters
    ----------
    value : object
        Any value.

    Examples
    --------
    >>> shown([1.0] * 50)
    '[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0...'
    """
    try:
        text = " ".join(visible_text(repr(value)).split())
    except ValueError:  # a whole number of thousands of digits
        return f"a number of type {type(value).__name__} with very many digits"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3].rstrip(', ')}..."


def _escape(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"
