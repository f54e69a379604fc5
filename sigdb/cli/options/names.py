"""An option whose choices are the names in a table of a package."""

from importlib import import_module

import click


class NameChoice(click.Choice[str]):
    """The names in a table of a package, read when they are needed."""

    def __init__(self, package: str, table: str) -> None:
        self.case_sensitive, self._package, self._table = True, package, table

    @property
    def choices(self) -> tuple[str, ...]:  # type: ignore[override]
        """The names, in the order of the table."""
        return tuple(getattr(import_module(self._package), self._table))
