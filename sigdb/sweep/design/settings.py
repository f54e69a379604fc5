"""The section ``[sweep]`` of a recipe: which cases are simulated, as a union of grids."""

from typing import Annotated

from pydantic import Field, Strict, field_validator, model_validator

from sigdb.core import Section, quantity, suggestion
from sigdb.dynamics import DEFAULT_SOLVER, SOLVERS
from sigdb.sweep.design.grid import Grid
from sigdb.transmission import PRESETS, ToothDamage


class SweepSettings(Section):
    """Settings of a sweep: the cases that it simulates."""

    rig: str = Field(description="Name of a built-in rig, or the path of a rig file from the recipe's folder.")
    gear: str | None = Field(default=None, description="The damaged gear; the first mesh's driving gear if left out.")
    seed: int = quantity("-", "Seed of samples, specimens and noise.", ge=0, default=0)
    specimens: int = quantity("-", "Number of pairs of gears, each with its own index errors.", ge=1, default=1)
    draws: int = quantity("-", "Number of noise draws of each case and specimen.", ge=1, default=1)
    healthy: int = quantity(
        "-",
        "Number of undamaged rows of each specimen at each combination of rig and measurement values.",
        ge=0,
        default=0,
    )
    grid: Annotated[tuple[Grid, ...], Strict(False)] = quantity("-", "Grids; the sweep is their union.", min_length=1)
    patterns: dict[str, Annotated[tuple[ToothDamage, ...], Strict(False)]] = Field(
        default={},
        description="Lists of damaged teeth that differ, by name. A pattern goes before a preset of the same name.",
    )

    solver: str = Field(
        default=DEFAULT_SOLVER, description=f"How a case is solved: {', '.join(SOLVERS)}; the first if left out."
    )

    @field_validator("solver")
    @classmethod
    def _check_solver(cls, name: str) -> str:
        if name not in SOLVERS:
            raise ValueError(f"solver = {name!r} is not known{suggestion(name, SOLVERS)}")
        return name

    @model_validator(mode="after")
    def _check_patterns(self) -> "SweepSettings":
        defined = ", ".join(dict.fromkeys((*self.patterns, *PRESETS)))
        problems = [
            f"pattern {name!r} is not defined; define it under [sweep.patterns] (known: {defined})"
            for name in self.named_patterns
            if name not in {*self.patterns, *PRESETS}
        ] + [
            f"patterns.{name} damages no tooth; give at least one tooth a loss or a shift"
            for name, teeth in self.patterns.items()
            if not any(tooth.is_damage for tooth in teeth)
        ]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    @property
    def named_patterns(self) -> tuple[str, ...]:
        """Names of the patterns that the grids use."""
        return tuple(dict.fromkeys(name for grid in self.grid for name in grid.patterns))
