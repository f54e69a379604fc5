"""Errors that a user can act on.

Each message names the owner (a file, a table, a function), the field, the rule, the value and the remedy.
"""

import difflib
from collections.abc import Iterable


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
    """Base of all errors that sigdb raises for a user to act on."""


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
