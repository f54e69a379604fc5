"""Errors that a user can act on.

Each message names the owner (a file, a table, a function), the field, the rule, the value and the remedy.
"""

import difflib
from collections.abc import Iterable


def suggestion(word: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown word: the nearest known one, or all of them.

    Examples
    --------
    >>> suggestion("teht", ["teeth", "node"])
    "; did you mean 'teeth'?"
    """
    known = sorted(known)
    near = difflib.get_close_matches(word, known, n=1)
    return f"; did you mean {near[0]!r}?" if near else f"; known: {', '.join(known)}" if known else ""


class SigdbError(Exception):
    """Something that a user can understand and act on; the base of all of sigdb's own errors."""


class InputError(SigdbError, ValueError):
    """Input that breaks a stated rule: a file, an option, an argument."""


class NotApplicableError(InputError):
    """A method that does not apply to input which is valid: a bound, a bank or a solver that has no answer for it.

    Callers may go on without the method. They never catch :class:`InputError` for that purpose, since a wrong name
    would then look the same.
    """


class UnstableRigError(SigdbError):
    """A rig without a steady state: its response grows without bound."""


class DatabaseError(SigdbError):
    """A database that cannot be read, written or continued as asked."""


class CorruptionError(DatabaseError):
    """A file of a database that is missing, or is not as it was written."""
