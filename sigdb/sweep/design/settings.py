"""The sections ``[sweep]`` and ``[limits]`` of a recipe: which cases are simulated, and how many at most."""

from typing import Annotated, Literal

from pydantic import Field, Strict, field_validator, model_validator

from sigdb.core import InputError, Section, quantity, suggestion
from sigdb.dynamics import DEFAULT_SOLVER, SOLVERS
from sigdb.sweep.design.grid import Grid
from sigdb.transmission import PRESETS, ToothDamage


class EnsembleSettings(Section):
    """An ensemble of rigs, drawn from what the rig file assumes: the values of the axis ``rig.member``."""

    members: int = quantity("-", "Number of members.", ge=1, le=10_000)
    seed: int = quantity("-", "Seed of the draws.", ge=0, default=0)
    values: Annotated[tuple[dict[str, int | float | str], ...], Strict(False)] = Field(
        default=(),
        description="Values of each member's assumed numbers, by dotted path; drawn by the seed if left out.",
    )

    @model_validator(mode="after")
    def _as_many(self) -> "EnsembleSettings":
        if self.values and len(self.values) != self.members:
            raise ValueError(f"values has {len(self.values)} members and members = {self.members}; give as many")
        return self


class SweepSettings(Section):
    """Settings of a sweep: the cases that it simulates."""

    rig: str = Field(description="Name of a built-in rig, or the path of a rig file from the recipe's folder.")
    gear: str | None = Field(default=None, description="The damaged gear; the first mesh's driving gear if left out.")
    seed: int = quantity("-", "Seed of samples, specimens and noise.", ge=0, default=0)
    specimens: int = quantity("-", "Number of pairs of gears, each with its own index errors.", ge=1, default=1)
    runout: float = quantity(
        "-",
        "Amplitude of the orders 1 and 2 of both gears' index errors, rms over specimens, over index_error.",
        ge=0,
        default=0.0,
        exclude_if=lambda runout: runout == 0,
    )
    draws: int = quantity("-", "Number of noise draws of each case and specimen.", ge=1, default=1)
    healthy: int = quantity(
        "-",
        "Number of undamaged rows of each specimen at each combination of rig and measurement values.",
        ge=0,
        default=0,
    )
    grid: Annotated[tuple[Grid, ...], Strict(False)] = quantity(
        "-", "Grids; the sweep is their union.", min_length=1, max_length=1000
    )
    ensemble: EnsembleSettings | None = Field(
        default=None,
        description="Rigs drawn from what is assumed of the rig: the axis rig.member, 1 to members in all grids.",
        exclude_if=lambda ensemble: ensemble is None,
    )
    patterns: dict[str, Annotated[tuple[ToothDamage, ...], Strict(False)]] = Field(
        default={},
        description="Lists of damaged teeth that differ, by name. A pattern goes before a preset of the same name.",
    )

    solver: str = Field(
        default=DEFAULT_SOLVER, description=f"How a case is solved: {', '.join(SOLVERS)}; the first if left out."
    )

    store: Literal["rows", "templates"] = Field(
        default="rows",
        description="Stored form of the rows: rows, or templates of which rows are made when they are read.",
        exclude_if=lambda store: store == "rows",
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


class SweepLimits(Section):
    """Limits of a sweep. They change nothing that a sweep makes, and a recipe may raise them."""

    rows: int = quantity("-", "Most rows of a sweep.", ge=1, le=10**12, default=100_000_000)
    templates: int = quantity(
        "-", "Most cases of damage in a grid; each different one is simulated.", ge=1, le=10**9, default=20_000_000
    )
    points: int = quantity(
        "-",
        "Most joint points, combinations of the rig's values, and measurements in a grid.",
        ge=1,
        le=10**9,
        default=1_000_000,
    )
    rigs: int = quantity("-", "Most rigs that differ in more than speed and torque.", ge=1, le=10**7, default=10_000)
    samples: int = quantity(
        "-", "Most samples in an average: samples of a tooth pass times teeth.", ge=64, le=2**24, default=32_768
    )

    def check(self, name: str, number: float, *, owner: str, what: str) -> None:
        """Refuse a number beyond a limit.

        Parameters
        ----------
        name
            Name of the limit.
        number
            The number.
        owner, what
            Where the number comes from and what it counts, for the message.

        Raises
        ------
        InputError
            Names the number, the limit and the key that raises it.
        """
        most = getattr(self, name)
        if number > most:
            raise InputError(
                f"{owner} has {number:.10g} {what}, and the limit is {most}; give fewer, or raise limits.{name}"
            )


WIDEST = SweepLimits(rows=10**12, templates=10**9, points=10**9, rigs=10**7, samples=2**24)
"""The limits of a plan that a database holds already."""
