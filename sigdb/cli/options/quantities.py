"""The type of options that hold a number with a unit: a plain number in the option's unit, or a text with its own."""

from typing import Any

import click

from sigdb.core import InputError, in_unit


class Quantity(click.FloatRange):
    """A number in a unit, such as 1480, or with another unit of its kind, such as 24.7Hz.

    Parameters
    ----------
    unit : str
        Unit of a plain number, and of the value that the command gets.
    **bounds
        Bounds of the value, as of :class:`click.FloatRange`.
    """

    name = "quantity"

    def __init__(self, unit: str, **bounds: Any) -> None:
        super().__init__(**bounds)
        self.unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number in the unit of the option."""
        if isinstance(value, str) and not _is_plain(value):
            try:
                value = in_unit(value, self.unit)
            except InputError as error:
                self.fail(f"{error}.", param, ctx)
        return float(super().convert(value, param, ctx))

    def _describe_range(self) -> str:
        return "" if self.min is None and self.max is None else super()._describe_range()


def _is_plain(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
