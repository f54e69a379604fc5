"""A part of a rig: a group of fields that also says where its numbers come from."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from sigdb.core import Section

ORIGINS = ("published", "derived", "assumed")

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
"""A name given to a part in a rig file; without dots, so that a dotted path is unambiguous."""


class Described(Section):
    """A part of a rig with the origin of its numbers.

    ``sources`` maps a field to a sentence that begins with ``published:``, ``derived:`` or ``assumed:``.
    """

    sources: dict[str, str] = Field(
        default={}, description="Origin of each number: published, derived or assumed, and why."
    )

    @model_validator(mode="after")
    def _check_sources(self) -> Self:
        for key, text in self.sources.items():
            if key not in type(self).model_fields:
                raise ValueError(f"sources.{key} names no field here; name one that the table holds")
            if text.split(":")[0] not in ORIGINS:
                raise ValueError(f"sources.{key} = {text!r} must begin with 'published:', 'derived:' or 'assumed:'")
        return self
