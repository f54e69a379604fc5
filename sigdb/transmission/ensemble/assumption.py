"""Assumptions of a rig file on a number: a range, choices, or a tie to another number.

They stand with the number's source, in the table ``assumed`` of its part:

- ``{low = 0.8e8, high = 2.0e8, scale = "log"}``: a range. With ``of``, the path of another number, it is one
  of multiples of that.
- ``{choices = [2, 3, 4]}``: one of these. ``as`` names another number with choices, whose i-th goes with the i-th here.
- ``{as = "bearings.pinion-front.stiffness", factor = 1.0}``: a tie.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Discriminator, Field, Strict, Tag, model_validator

from sigdb.core import Section, quantity

_ROUNDING = 1e-9
"""Part of its size by which a number may be outside its range, since files round."""

Choice = int | float | str
"""A number or a name; a table is named by its ``kind``."""


class Range(Section):
    """A range of a number, or of a list by its first component that is not 0: the others keep their ratio to it.

    Examples
    --------
    >>> Range(low=1e8, high=4e8, scale="log").at(0.5)
    200000000.0
    """

    low: float = quantity("-", "Least value, in the unit of the number.")
    high: float = quantity("-", "Greatest value.")
    scale: Literal["linear", "log"] = Field(
        default="linear", description="Whether values or their logarithms are equally likely."
    )
    of: str | None = Field(
        default=None,
        description="Dotted path of another number: low and high are multiples of it.",
        exclude_if=lambda value: value is None,
    )

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low = {self.low:g} must be less than high = {self.high:g}; state a number without one")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"low = {self.low:g} must be greater than 0 for scale = 'log'; raise it, or use 'linear'")
        return self

    def at(self, u: float) -> float:
        """Return the value at a coordinate from 0 at ``low`` to 1 at ``high``."""
        if self.scale == "log":
            return float(min(max(self.low * (self.high / self.low) ** u, self.low), self.high))
        return float(self.low + u * (self.high - self.low))

    def unit(self, value: Choice) -> float:
        """Return the coordinate of a number, from 0 to 1."""
        number = float(value)
        if self.scale == "log":
            u = math.log(number / self.low) / math.log(self.high / self.low)
        else:
            u = (number - self.low) / (self.high - self.low)
        return min(max(u, 0.0), 1.0)

    def holds(self, value: object) -> bool:
        """Return whether a value is in the range."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            return False
        slack = _ROUNDING * max(abs(self.low), abs(self.high))
        return self.low - slack <= value <= self.high + slack

    def __str__(self) -> str:
        scale = ", log" if self.scale == "log" else ""
        return f"{self.low:g} to {self.high:g}{f' times {self.of}' if self.of else ''}{scale}"


class Choices(Section):
    """Discrete values, or tables, which are named by their ``kind``.

    Examples
    --------
    >>> Choices(choices=("left", "right")).at(0.7)
    'right'
    """

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True, validate_by_alias=True)

    choices: Annotated[tuple[int | float | str | dict[str, Any], ...], Strict(False)] = Field(
        description="The values; tables for a field that is a table."
    )
    target: str | None = Field(
        default=None,
        alias="as",
        description="Dotted path of another number with choices: they are chosen together.",
        exclude_if=lambda value: value is None,
    )

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if len(self.choices) < 2:
            raise ValueError(f"choices = {list(self.choices)} has no alternative; give two or more")
        for choice in self.choices:
            if isinstance(choice, dict) and not isinstance(choice.get("kind"), str):
                raise ValueError("choices that are tables need a kind each; add it")
            if isinstance(choice, dict) and self.target is not None:
                raise ValueError("choices that are tables cannot go with others; tie the whole table by 'as' alone")
        if len(set(map(repr, self.labels))) < len(self.labels) and self.target is None:
            raise ValueError(f"choices = {list(self.labels)} repeat one; give each once")
        return self

    @property
    def labels(self) -> tuple[Choice, ...]:
        """The values, tables by their ``kind``."""
        return tuple(choice["kind"] if isinstance(choice, dict) else choice for choice in self.choices)

    def at(self, u: float) -> Choice:
        """Return the value at a coordinate from 0 to 1: each has an equal part."""
        return self.labels[min(int(u * len(self.choices)), len(self.choices) - 1)]

    def unit(self, value: Choice) -> float:
        """Return the coordinate at the middle of a value's part."""
        return (self.labels.index(value) + 0.5) / len(self.choices)

    def holds(self, value: object) -> bool:
        """Return whether a value is one of them."""
        return not isinstance(value, bool) and value in self.labels

    def __str__(self) -> str:
        listed = ", ".join(map(str, self.labels))
        return f"{listed}, with {self.target}" if self.target else f"one of {listed}"


class Tie(Section):
    """A number, list or table that follows another one of the rig.

    Examples
    --------
    >>> str(Tie.model_validate({"as": "bearings.front.stiffness", "factor": 0.5}))
    '0.5 times bearings.front.stiffness'
    """

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True, validate_by_alias=True)

    target: str = Field(alias="as", description="Dotted path of the other.")
    factor: float = quantity("-", "Multiple of the other.", default=1.0)

    def __str__(self) -> str:
        return f"as {self.target}" if self.factor == 1 else f"{self.factor:g} times {self.target}"


def _kind(value: object) -> str:
    """Return which kind of assumption a table of a rig file is."""
    if isinstance(value, Range | Choices | Tie):
        return type(value).__name__
    keys = set(value) if isinstance(value, Mapping) else set()
    return "Choices" if "choices" in keys else "Tie" if "as" in keys else "Range"


Assumption = Annotated[
    Annotated[Range, Tag("Range")] | Annotated[Choices, Tag("Choices")] | Annotated[Tie, Tag("Tie")],
    Discriminator(_kind),
]
"""A range, choices or a tie, as a rig file has them."""


def flattened(assumed: object, prefix: str = "") -> object:
    """Return a table ``assumed`` by dotted keys: TOML reads ``assumed.stiffness.2 = {...}`` as tables in tables.

    Examples
    --------
    >>> flattened({"stiffness": {"2": {"low": 1.0, "high": 2.0}}})
    {'stiffness.2': {'low': 1.0, 'high': 2.0}}
    """
    if not isinstance(assumed, Mapping):
        return assumed
    flat: dict[str, object] = {}
    for key, value in assumed.items():
        nested = isinstance(value, Mapping) and value and all(isinstance(item, Mapping) for item in value.values())
        inner = flattened(value, f"{prefix}{key}.") if nested else {f"{prefix}{key}": value}
        flat |= inner if isinstance(inner, dict) else {}
    return flat
