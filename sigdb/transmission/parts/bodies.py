"""Rigid bodies on shafts: what gears and disks have in common."""

from typing import Self

import numpy as np
from pydantic import Field, model_validator

from sigdb.core import Section, quantity
from sigdb.transmission.parts.described import Described


class Body(Section):
    """Inertia of a rigid body at a node."""

    mass: float = quantity("kg", "Mass.", ge=0)
    polar_inertia: float = quantity("kg m^2", "Inertia about the shaft's axis.", ge=0)
    diametral_inertia: float = quantity("kg m^2", "Inertia about a diameter.", ge=0)


def cylinder(density: float, outer_radius: float, inner_radius: float, length: float) -> Body:
    """A hollow cylinder: ``m = rho pi (R^2 - r^2) L``, ``Ip = m (R^2 + r^2) / 2``, ``Id = Ip / 2 + m L^2 / 12``.

    Examples
    --------
    >>> round(cylinder(7800.0, 0.1, 0.0, 0.02).mass, 3)
    4.901
    """
    mass = density * np.pi * (outer_radius**2 - inner_radius**2) * length
    polar = mass * (outer_radius**2 + inner_radius**2) / 2
    return Body(mass=mass, polar_inertia=polar, diametral_inertia=polar / 2 + mass * length**2 / 12)


class Rotating(Described):
    """A rigid body on a node of a shaft, with its unbalance.

    Its inertia is given as numbers, or follows from the shape that a subclass describes.
    """

    shaft: str = Field(description="Name of the shaft that carries it.")
    node: int = quantity("-", "Node of the shaft at its middle, from 0.", ge=0)
    mass: float | None = quantity("kg", "Mass, where it is given as a number.", gt=0, default=None)
    polar_inertia: float | None = quantity("kg m^2", "Inertia about the shaft's axis, with mass.", gt=0, default=None)
    diametral_inertia: float | None = quantity("kg m^2", "Inertia about a diameter, with mass.", ge=0, default=None)
    unbalance: float = quantity("kg m", "Mass times eccentricity.", ge=0, default=0.0)
    unbalance_angle_deg: float = quantity(
        "deg",
        "Angle of the unbalance from the shaft's x axis at the tacho mark, in the sense of rotation.",
        default=0.0,
    )

    @model_validator(mode="after")
    def _inertia_or_shape(self) -> Self:
        numbers = ("mass", "polar_inertia", "diametral_inertia")
        stated = {name for name in numbers if getattr(self, name) is not None}
        shape = {name for name in self.shape_fields() if getattr(self, name) is not None}
        if stated and shape:
            raise ValueError(
                f"{sorted(stated)[0]} and {sorted(shape)[0]} are both given; give numbers or a shape, not both"
            )
        if stated and (self.mass is None or self.polar_inertia is None):
            raise ValueError("mass and polar_inertia belong together; give both")
        if not stated and shape != self.shape_fields():
            lacking = sorted(self.shape_fields() - shape)
            raise ValueError(
                f"{lacking[0]} is missing; give {', '.join(sorted(self.shape_fields()))}, or mass and polar_inertia"
            )
        return self

    @classmethod
    def shape_fields(cls) -> set[str]:
        """Fields that describe the body's shape, all of them needed where no mass is given."""
        raise NotImplementedError

    @property
    def body(self) -> Body | None:
        """The inertia where it is given as numbers."""
        if self.mass is None or self.polar_inertia is None:
            return None
        return Body(mass=self.mass, polar_inertia=self.polar_inertia, diametral_inertia=self.diametral_inertia or 0.0)


class Disk(Rotating):
    """A disk: a flange, a flywheel, a turbine."""

    outer_diameter: float | None = quantity("m", "Outer diameter, where no mass is given.", gt=0, default=None)
    inner_diameter: float = quantity("m", "Bore.", ge=0, default=0.0)
    width: float | None = quantity("m", "Width.", gt=0, default=None)
    material: str | None = Field(default=None, description="Name of its material.")

    @classmethod
    def shape_fields(cls) -> set[str]:
        return {"outer_diameter", "width", "material"}

    def inertia(self, density: float) -> Body:
        """Its inertia; the density counts only where no mass is given."""
        if self.body is not None:
            return self.body
        assert self.outer_diameter is not None
        assert self.width is not None
        return cylinder(density, self.outer_diameter / 2, self.inner_diameter / 2, self.width)
