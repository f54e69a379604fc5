"""Sensors: outputs of a rig, by name."""

from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sigdb.core import Vector, quantity
from sigdb.transmission.parts.described import Described

QUANTITIES = {"displacement": (0, "m"), "velocity": (1, "m/s"), "acceleration": (2, "m/s^2")}
"""Order of the time derivative and unit of each measured quantity."""


class Sensor(Described):
    """Absolute motion of a gear's centre or of a point of the casing, along one direction."""

    gear: str | None = Field(default=None, description="Gear whose centre is measured.")
    point: str | None = Field(default=None, description="Point of the casing that is measured.")
    direction: Vector = quantity("-", "Direction of sensitivity in the casing's frame; only its direction counts.")
    quantity: Literal["displacement", "velocity", "acceleration"] = Field(description="Measured quantity.")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if (self.gear is None) == (self.point is None):
            raise ValueError("give either gear or point, one of the two, as the place of the sensor")
        if not np.linalg.norm(self.direction) > 0:
            raise ValueError("direction = [0, 0, 0] has no direction; give for example [0, 1, 0] for vertical")
        return self

    @property
    def derivative(self) -> int:
        """Order of the time derivative of displacement: 0, 1 or 2."""
        return QUANTITIES[self.quantity][0]

    @property
    def unit(self) -> str:
        """SI unit of the signal."""
        return QUANTITIES[self.quantity][1]
