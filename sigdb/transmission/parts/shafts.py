"""Shafts: stepped, hollow or solid, described by segments that the finite-element model divides into beams."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from sigdb.core import FloatArray, Vector, quantity
from sigdb.transmission.parts.described import Described


class Material(Described):
    """An isotropic elastic material."""

    density: float = quantity("kg/m^3", "Mass density.", gt=0)
    young_modulus: float = quantity("Pa", "Young's modulus E.", gt=0)
    shear_modulus: float = quantity("Pa", "Shear modulus G.", gt=0)

    @model_validator(mode="after")
    def _isotropic(self) -> Self:
        if not -1 < self.poisson_ratio <= 0.5:
            raise ValueError(
                f"young_modulus = {self.young_modulus:g}, shear_modulus = {self.shear_modulus:g} give Poisson's ratio "
                f"of {self.poisson_ratio:.3g}, outside -1 to 0.5; correct one of them"
            )
        return self

    @property
    def poisson_ratio(self) -> float:
        """``E / 2G - 1``."""
        return self.young_modulus / (2 * self.shear_modulus) - 1


class Segment(Described):
    """A length of shaft of one cross-section."""

    length: float = quantity("m", "Length of the segment.", gt=0)
    outer_diameter: float = quantity("m", "Outer diameter.", gt=0)
    inner_diameter: float = quantity("m", "Bore diameter, 0 for a solid shaft.", ge=0, default=0.0)
    material: str | None = Field(default=None, description="Name of its material; the shaft's if left out.")
    elements: int = quantity("-", "Number of equal beam elements that the segment is divided into.", ge=1, default=1)

    @model_validator(mode="after")
    def _hollow(self) -> Self:
        if self.inner_diameter >= self.outer_diameter:
            raise ValueError(
                f"inner_diameter = {self.inner_diameter} must be less than outer_diameter = {self.outer_diameter}"
            )
        return self


MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
Motion = Literal["x", "y", "z", "rx", "ry", "rz"]


class Shaft(Described):
    """A shaft in its own frame: z along ``axis``, y as near to the casing's vertical (Y) as it can be."""

    axis: Vector = quantity("-", "Direction of the shaft's z axis in the casing's frame; nodes are numbered along it.")
    material: str | None = Field(default=None, description="Name of the material of its segments.")
    segments: Annotated[tuple[Segment, ...], Strict(False)] = quantity(
        "-", "Segments in order along z; none for a rigid, massless shaft of one node.", default=()
    )
    motions: Annotated[tuple[Motion, ...], Strict(False)] = quantity(
        "-",
        "Motions that its nodes can make: translations x, y, z and rotations rx, ry, rz in its own frame.",
        default=MOTIONS,
    )

    @model_validator(mode="after")
    def _directed(self) -> Self:
        if "rz" not in self.motions:
            raise ValueError(
                f"motions = {list(self.motions)} leaves out rz; a shaft must be able to turn about its axis"
            )
        if not np.linalg.norm(self.axis) > 0:
            raise ValueError(
                "axis = [0, 0, 0] has no direction; give the direction of the shaft, for example [0, 0, 1]"
            )
        return self

    @property
    def nodes(self) -> int:
        """Number of nodes; they are numbered from 0."""
        return 1 + sum(segment.elements for segment in self.segments)

    @property
    def rotation(self) -> FloatArray:
        """(3, 3) rotation from the shaft's frame to the casing's: columns are the shaft's x, y, z axes."""
        z = np.asarray(self.axis) / np.linalg.norm(self.axis)
        upright = np.array([0.0, 1.0, 0.0]) if abs(z[1]) < 0.999 else np.array([1.0, 0.0, 0.0])
        y = upright - (upright @ z) * z
        y /= np.linalg.norm(y)
        return np.column_stack([np.cross(y, z), y, z])
