"""What holds and drives the rotors: bearings, couplings to end machines, and the casing."""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from sigdb.core.fields import Vector, quantity
from sigdb.core.typing import FloatArray
from sigdb.transmission.described import Described


class Bearing(Described):
    """A linear bearing between a node of a shaft and a point of the casing, in the shaft's frame.

    Force on the casing: ``Fb = Cb (W' - T Wc') + Kb (W - T Wc)``, equation (3) of the paper.
    """

    shaft: str = Field(description="Name of the shaft.")
    node: int = quantity("-", "Node of the shaft, from 0.", ge=0)
    seat: str | None = Field(default=None, description="Point of the casing that it sits in; none: rigid ground.")
    stiffness: Vector = quantity("N/m", "Stiffness along the shaft's x, y and z (axial).")
    tilt_stiffness: float = quantity("N m/rad", "Stiffness against tilting about x and y.", ge=0, default=0.0)
    damping: Vector = quantity("N s/m", "Viscous damping along x, y and z.", default=(0.0, 0.0, 0.0))

    @model_validator(mode="after")
    def _not_negative(self) -> Self:
        for key in ("stiffness", "damping"):
            if min(getattr(self, key)) < 0:
                raise ValueError(f"{key} = {list(getattr(self, key))} must not be negative")
        return self


class Coupling(Described):
    """A machine at a shaft's node: an inertia behind a torsional spring. Torque enters and leaves there."""

    shaft: str = Field(description="Name of the shaft.")
    node: int = quantity("-", "Node of the shaft, from 0.", ge=0)
    stiffness: float = quantity("N m/rad", "Torsional stiffness between the node and the machine.", gt=0)
    inertia: float = quantity("kg m^2", "Polar inertia of the machine.", gt=0)


class CasingMode(Described):
    """A mode of the casing without its rotors, equation (6): ``Wc = sum shape eta``."""

    frequency_hz: float = quantity("Hz", "Natural frequency.", gt=0)
    damping_ratio: float = quantity("-", "Fraction of critical damping.", ge=0, lt=1)
    modal_mass: float = quantity("kg", "Modal mass that belongs to the shape's scale.", gt=0)
    shape: dict[str, Vector] = Field(description="Displacement (X, Y, Z) of each point of the casing in this mode.")


class Casing(Described):
    """The casing, by its modes."""

    modes: Annotated[tuple[CasingMode, ...], Strict(False)] = Field(default=(), description="Modes of the casing.")

    @model_validator(mode="after")
    def _same_points(self) -> Self:
        for i, mode in enumerate(self.modes):
            if set(mode.shape) != set(self.modes[0].shape):
                raise ValueError(
                    f"modes.{i}.shape names the points {sorted(mode.shape)}, "
                    f"the first mode {sorted(self.modes[0].shape)}; "
                    "give every mode's shape at the same points"
                )
        return self

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points at which the shapes are given."""
        return tuple(self.modes[0].shape) if self.modes else ()

    def shapes(self, point: str) -> FloatArray:
        """(3, modes) displacement of a point in each mode, in the casing's frame."""
        return np.array([mode.shape[point] for mode in self.modes]).T
