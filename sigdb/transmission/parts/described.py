"""A part of a rig: a group of fields that also says where its numbers come from, and what is assumed of them."""

from collections.abc import Iterator
from typing import Annotated, Any, Self

from pydantic import BaseModel, BeforeValidator, Field, field_validator, model_validator

from sigdb.core import PHYSICAL, Section, in_si, suggestion, unit_of
from sigdb.transmission.ensemble.assumption import Assumption, Choices, Range, flattened

ORIGINS = ("published", "derived", "fitted", "assumed")
NOTES = ("sources", "assumed")
"""Fields about the other fields; they do not enter the dynamics."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
"""A name given to a part in a rig file; without dots, so that a dotted path is unambiguous."""


class Described(Section):
    """A part of a rig with the origin of its numbers, and what is assumed of them.

    ``sources`` maps a field to a sentence that begins with ``published:``, ``derived:``, ``fitted:`` or ``assumed:``.
    ``assumed`` maps a field, or a component such as ``stiffness.2``, to a range, choices or a tie.
    """

    sources: dict[str, str] = Field(
        default={}, description="Origin of each number: published, derived, fitted or assumed, and why."
    )
    assumed: Annotated[dict[str, Assumption], BeforeValidator(flattened)] = Field(
        default={},
        description="Range, choices or tie of each number that is not known.",
        exclude_if=lambda assumed: not assumed,  # rigs without are dumped as before there were any
    )

    @field_validator("assumed", mode="before")
    @classmethod
    def _ranges_in_si(cls, assumed: object) -> object:
        """Return ranges and choices whose texts with units are numbers in the unit of their field."""
        if not isinstance(assumed, dict):
            return assumed
        units = {name: unit_of(field) for name, field in cls.model_fields.items()}
        return {key: _in_unit_of(table, units.get(str(key).split(".")[0], "-")) for key, table in assumed.items()}

    @model_validator(mode="after")
    def _check_sources(self) -> Self:
        for key, text in self.sources.items():
            if key not in type(self).model_fields:
                raise ValueError(f"sources.{key} names no field here; name one that the table holds")
            if text.split(":")[0] not in ORIGINS:
                origins = ", ".join(f"'{origin}:'" for origin in ORIGINS)
                raise ValueError(f"sources.{key} = {text!r} must begin with one of {origins}")
        return self

    @model_validator(mode="after")
    def _check_assumed(self) -> Self:
        problems = [problem for key, assumption in self.assumed.items() for problem in _problems(self, key, assumption)]
        if problems:
            raise ValueError("\n".join(problems))
        return self


def _in_unit_of(table: object, unit: str) -> object:
    """Return an assumption, or those of the components of a list, with numbers in a unit; multiples have none."""
    if not isinstance(table, dict) or "of" in table or unit not in PHYSICAL:
        return table
    return {
        key: in_si(value, unit) if key in ("low", "high", "choices") else _in_unit_of(value, unit)
        for key, value in table.items()
    }


def _problems(part: Described, key: str, assumption: Assumption) -> Iterator[str]:
    """Sentences on an assumption that does not fit its field."""
    names = key.split(".")
    fields = [name for name in type(part).model_fields if name not in NOTES]
    if names[0] not in fields:
        yield f"assumed.{key} names no field here{suggestion(names[0], fields)}"
        return
    value: Any = part
    for name in names:
        value = item(value, name)
    if value is None:
        yield f"assumed.{key} names no number that is stated here; state it, or remove the assumption"
    elif isinstance(assumption, Range) and not is_ranged(value):
        whole = isinstance(value, int) and not isinstance(value, bool)
        yield (
            f"assumed.{key}: {'a whole number has' if whole else 'only a number or a list of numbers has'} a range"
            + (" by choices = [...]" if whole else "; give choices, or name a number")
        )
    elif isinstance(assumption, Choices) and not all(_alike(value, choice) for choice in assumption.choices):
        yield f"assumed.{key}: choices = {list(assumption.labels)} must be of the kind of its value, {shown(value)}"


def item(here: object, name: str) -> Any:
    """Return what a name or a number leads to in a section, a table or a list; None where there is nothing."""
    if isinstance(here, BaseModel):
        return getattr(here, name) if name in type(here).model_fields else None
    if isinstance(here, dict):
        return here.get(name)
    if isinstance(here, tuple | list) and name.isdigit() and int(name) < len(here):
        return here[int(name)]
    return None


def is_ranged(value: object) -> bool:
    """Return whether a value can have a range: a number with a fraction, or a list of such that is not all 0."""
    if isinstance(value, tuple | list):
        return all(isinstance(number, float) for number in value) and any(value)
    return isinstance(value, float)


def shown(value: object) -> str:
    """Return a value of a rig in a message."""
    if isinstance(value, BaseModel):
        return repr(item(value, "kind"))
    return repr(list(value) if isinstance(value, tuple) else value)


def _alike(value: object, choice: object) -> bool:
    if isinstance(choice, dict):
        return isinstance(value, BaseModel) and "kind" in type(value).model_fields
    if isinstance(value, float):
        return isinstance(choice, int | float)
    return type(value) is type(choice)
