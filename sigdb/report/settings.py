"""The section ``[report]`` of a recipe."""

from collections import Counter
from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from sigdb.core import Section, quantity

Panel = Literal["stiffness", "signal", "spectrum", "distribution"]
"""Panels of a case: mesh stiffness, averaged signal, order spectrum, Wigner-Ville distribution."""
_SIGNATURE: tuple[Panel, ...] = ("signal", "spectrum", "distribution")


class Picture(Section):
    """A picture of cases side by side."""

    name: str = Field(
        description="Name of the picture's file, without its suffix.", pattern=r"^[A-Za-z][A-Za-z0-9._-]*$"
    )
    title: str = Field(default="", description="Text above the picture.")
    caption: str = Field(default="", description="Text below the picture.")
    sensor: str | None = Field(default=None, description="Sensor; the first stored one if left out.")
    rows: Annotated[tuple[str, ...], Strict(False)] = Field(
        description="Conditions in SQL, each of which selects one case of the database: a column of the picture.",
        min_length=1,
    )
    panels: Annotated[tuple[Panel, ...], Strict(False)] = Field(
        default=_SIGNATURE, description="Panels of each case, from top to bottom.", min_length=1
    )


class ReportSettings(Section):
    """Appearance of pictures, and the pictures that a run of the recipe draws."""

    mesh_orders: float = quantity("-", "Highest order shown, as a multiple of the tooth count.", ge=1, default=4.0)
    dots_per_inch: int = quantity("1/inch", "Resolution of PNG files.", ge=50, le=600, default=110)
    figures: Annotated[tuple[Picture, ...], Strict(False)] = Field(default=(), description="Pictures of a run.")
    paper: bool = Field(
        default=False, description="Whether a run compares the rig with the paper that the model follows."
    )

    @model_validator(mode="after")
    def _names_differ(self) -> "ReportSettings":
        for name, count in Counter(picture.name for picture in self.figures).items():
            if count > 1:
                raise ValueError(f"figures: the name {name!r} occurs twice; each picture is a file with its own name")
        return self
