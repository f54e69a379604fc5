"""Lives: severities that grow by a law, as joint points of a grid, and the time of each."""

from collections.abc import Iterable, Mapping
from typing import Literal, cast

import numpy as np
import pandas as pd
from pydantic import Field, model_validator

from sigdb.core import Section, quantity
from sigdb.prognosis import severity_after
from sigdb.sweep.design.axes import DAMAGE_AXES, WHOLE_AXES, Range, check_bounds

_MOST_POINTS = 100_000


class Life(Section):
    """Lives of gears, whose damage grows from a start to a limit by a law, with parameters drawn for each life.

    Times are in any unit, that of the rates. A life has a look at each whole number of intervals until its severity
    exceeds the limit.
    """

    law: Literal["paris", "archard", "pits"] = Field(
        description="Law of growth: a crack by Paris, wear by Archard, or pits that come as a Poisson process."
    )
    size: str = Field(default="stiffness_loss", description="Axis of damage that grows; pits for their number.")
    start: float = quantity("-", "Severity at the beginning, in the unit of the axis.", gt=0)
    limit: float = quantity("-", "Severity at which a life ends, in the unit of the axis.", gt=0)
    rate: Range = Field(
        description="Speed of growth at the limit, per unit of time: its ends; lives are drawn evenly in its logarithm."
    )
    exponent: Range = Field(
        default=Range(min=3.0, max=3.0), description="Exponent m of Paris: its ends; lives are drawn evenly."
    )
    interval: float = quantity("-", "Time between two looks.", gt=0, default=1.0)
    looks: int = quantity("-", "Most looks of a life.", ge=2, default=100)
    lives: int = quantity("-", "Number of lives.", ge=1, default=1)
    seed: int = quantity("-", "Seed of the parameters.", ge=0, default=0)

    @model_validator(mode="after")
    def _consistent(self) -> "Life":
        problems = []
        if self.size not in DAMAGE_AXES:
            problems.append(f"life.size = {self.size!r} is no axis of damage; known: {', '.join(DAMAGE_AXES)}")
        elif (self.size in WHOLE_AXES) != (self.law == "pits"):
            problems.append(
                f"life.size = {self.size!r} does not grow by {self.law}; pits is for numbers, others for sizes"
            )
        if self.start >= self.limit:
            problems.append(f"life.start = {self.start:g} must be less than life.limit = {self.limit:g}")
        if self.rate.min <= 0:
            problems.append(f"life.rate.min = {self.rate.min:g} must be greater than 0")
        if self.exponent.min < 0:
            problems.append(f"life.exponent.min = {self.exponent.min:g} must be 0 or more")
        if self.looks * self.lives > _MOST_POINTS:
            problems.append(
                f"life has {self.looks} looks of {self.lives} lives, and the limit is {_MOST_POINTS} in all"
            )
        if problems:
            raise ValueError("\n".join(problems))
        for severity in (self.start, self.limit):
            check_bounds(self.size, severity, label=f"life: {self.size}")
        return self

    def trajectories(self) -> pd.DataFrame:
        """Return the looks of all lives.

        Returns
        -------
        pandas.DataFrame
            ``life`` (number, from 0), ``time``, the severity under the name of its axis, ``rate`` and ``exponent``.
        """
        stream = np.random.default_rng(self.seed)
        times = self.interval * np.arange(self.looks)
        lives = []
        for life in range(self.lives):
            rate = float(np.exp(stream.uniform(np.log(self.rate.min), np.log(self.rate.max))))
            exponent = float(stream.uniform(self.exponent.min, self.exponent.max)) if self.law == "paris" else 0.0
            severity = self._severity(times, rate, exponent, stream)
            kept = severity <= self.limit * (1 + 1e-9)
            facts = {
                "life": life,
                "time": times[kept],
                self.size: np.minimum(severity[kept], self.limit),
                "rate": rate,
                "exponent": exponent,
            }
            lives.append(pd.DataFrame(facts))
        return pd.concat(lives, ignore_index=True)

    def table(self) -> dict[str, list[float]]:
        """Return the joint points: the severity of each look, the number of its life from 1, and its time."""
        looks = self.trajectories()
        return {
            self.size: looks[self.size].tolist(),
            "life_number": (looks["life"] + 1).tolist(),
            "life_time": looks["time"].tolist(),
        }

    def _severity(self, times: np.ndarray, rate: float, exponent: float, stream: np.random.Generator) -> np.ndarray:
        """Return the severity at each time."""
        if self.law == "pits":
            return np.asarray(self.start + np.cumsum([0, *stream.poisson(rate * self.interval, len(times) - 1)]))
        return severity_after(self.start, times, rate=rate, exponent=exponent, reference=self.limit)


def with_life(keys: Mapping[str, object]) -> dict[str, object]:
    """Return the keys of a grid with the joint points of its life as its table.

    Raises
    ------
    ValueError
        If the grid has another table too.
    """
    life = keys.get("life")
    if life is None:
        return dict(keys)
    section = life if isinstance(life, Life) else Life.model_validate(life)
    table = section.table()
    stated = cast(Mapping[str, Iterable[float]], keys.get("table") or table)
    if {name: list(values) for name, values in stated.items()} != table:
        raise ValueError("life and table are given together; a life is a table by itself")
    return {**keys, "life": section, "table": table}
