"""The section ``[signature]`` of a recipe."""

from collections import Counter
from typing import Annotated, Self

from pydantic import Field, Strict, model_validator

from sigdb.core import Section, quantity


class SignatureSettings(Section):
    """Settings of the stored signatures."""

    samples_per_tooth: int = quantity(
        "-",
        "Samples in a tooth pass of the average; turning by a tooth is then a whole number of samples.",
        ge=32,
        default=64,
    )
    sensors: Annotated[tuple[str, ...], Strict(False)] = Field(
        default=(), description="Sensors whose signatures are stored; all of the rig's if left out."
    )

    @model_validator(mode="after")
    def _once(self) -> Self:
        for sensor, count in Counter(self.sensors).items():
            if count > 1:
                raise ValueError(f"sensors names {sensor!r} twice; name each sensor once")
        return self
