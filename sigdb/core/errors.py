"""Errors that a user can act on.

Each message names the owner (a file, a table, a function), the field, the rule, the value and the remedy.
"""


class SigdbError(Exception):
    """Something that a user can understand and act on; the base of all of sigdb's own errors."""


class InputError(SigdbError, ValueError):
    """Input that breaks a stated rule: a file, an option, an argument."""


class UnstableRigError(SigdbError):
    """A rig without a steady state: its response grows without bound."""


class DatabaseError(SigdbError):
    """A database that cannot be read, written or continued as asked."""
