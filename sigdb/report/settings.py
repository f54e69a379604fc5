"""The section ``[report]`` of a recipe."""

from typing import Annotated, Literal

from pydantic import Field, Strict, model_validator

from sigdb.core import Section, quantity

Panel = Literal["stiffness", "signal", "spectrum", "distribution"]
"""What is shown of a case: mesh stiffness, averaged signal, order spectrum, Wigner-Ville distribution."""
_SIGNATURE: tuple[Panel, ...] = ("signal", "spectrum", "distribution")


class Picture(Section):
    """A figure of cases side by side."""

    name: str = Field(
        description="Name of the picture's file, without its suffix.", pattern=r"^[A-Za-z][A-Za-z0-9._-]*$"
    )
    title: str = Field(default="", description="What stands above the figure.")
    caption: str = Field(default="", description="What stands below it.")
    sensor: str | None = Field(default=None, description="Sensor; the first stored one if left out.")
    rows: Annotated[tuple[str, ...], Strict(False)] = Field(
        description="Conditions in SQL, each of which selects one case of the database: a column of the figure.",
        min_length=1,
    )
    panels: Annotated[tuple[Panel, ...], Strict(False)] = Field(
        default=_SIGNATURE, description="What is shown of each case, from top to bottom.", min_length=1
    )


class ReportSettings(Section):
    """How pictures look, and which a run of the recipe makes."""

    mesh_orders: float = quantity("-", "Highest order shown, as a multiple of the tooth count.", ge=1, default=4.0)
    dots_per_inch: int = quantity("1/inch", "Resolution of PNG files.", ge=50, le=600, default=110)
    figures: Annotated[tuple[Picture, ...], Strict(False)] = Field(default=(), description="Figures of a run.")
    paper: bool = Field(
        default=False, description="Whether a run tells how the rig compares with the paper that the model follows."
    )

    @model_validator(mode="after")
    def _names_differ(self) -> "ReportSettings":
        names = [one.name for one in self.figures]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"figures: the name {name!r} is given twice; each figure is a file of its own")
        return self
