"""Supports and drives of the rotors: bearings, couplings to end machines, and the casing."""

from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)

from sigdb.core import FloatArray, Vector, in_si, quantity
from sigdb.transmission.parts.described import Described
from sigdb.transmission.parts.rolling_bearing import RollingBearing

Row6 = Annotated[tuple[float, float, float, float, float, float], Strict(False)]


Matrix6 = Annotated[tuple[Row6, ...], Strict(False)]
"""Six rows of six: x, y, z, rx, ry, rz in the shaft's frame."""


_MOTIONS = ("m", "m", "m", "rad", "rad", "rad")
_ENTRIES = {
    f"{name}_matrix": [[f"{force}{rate}/{motion}" for motion in _MOTIONS] for force in ("N",) * 3 + ("N m",) * 3]
    for name, rate in (("stiffness", ""), ("damping", " s"))
}
"""Units of the entries of matrices: forces and moments over translations and rotations."""


class Bearing(Described):
    """A linear bearing between a node of a shaft and a point of the casing, in the shaft's frame.

    Force on the casing: ``Fb = Cb (W' - T Wc') + Kb (W - T Wc)``, equation (3) of the paper. Stiffness is given by
    ``stiffness`` and ``tilt_stiffness``, or by a full matrix with cross terms, which need not be symmetric; damping
    likewise. A casing's points translate only: tilting is against rigid ground.
    """

    shaft: str = Field(description="Name of the shaft.")
    node: int = quantity("-", "Node of the shaft, from 0.", ge=0)
    seat: str | None = Field(default=None, description="Point of the casing that it sits in; none: rigid ground.")
    stiffness: Vector | None = quantity("N/m", "Stiffness along the shaft's x, y and z (axial).", default=None)
    tilt_stiffness: float = quantity("N m/rad", "Stiffness against tilting about x and y.", ge=0, default=0.0)
    damping: Vector = quantity("N s/m", "Viscous damping along x, y and z.", default=(0.0, 0.0, 0.0))
    stiffness_matrix: Matrix6 | None = quantity(
        "N/m", "6 x 6 stiffness over x, y, z, rx, ry, rz; rotations in N m/rad.", default=None
    )
    damping_matrix: Matrix6 | None = quantity(
        "N s/m", "6 x 6 damping over x, y, z, rx, ry, rz; rotations in N m s/rad.", default=None
    )

    rolling: RollingBearing | None = Field(
        default=None,
        description="Geometry of a rolling bearing, for the orders of its faults; it does not enter the dynamics.",
    )

    @field_validator("stiffness_matrix", "damping_matrix", mode="before")
    @classmethod
    def _entries_in_si(cls, rows: object, info: ValidationInfo) -> object:
        """Return a matrix whose entries with units are in the unit of their place."""
        return in_si(rows, _ENTRIES[str(info.field_name)])

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        for key in ("stiffness", "damping"):
            matrix = getattr(self, f"{key}_matrix")
            if matrix is not None and len(matrix) != 6:
                raise ValueError(f"{key}_matrix has {len(matrix)} rows; give 6 rows of 6 numbers")
            if matrix is not None and any(getattr(self, key) or ()):
                raise ValueError(f"{key} and {key}_matrix are both given; give one of them")
            if matrix is None and min(getattr(self, key) or (0.0,)) < 0:
                raise ValueError(f"{key} = {list(getattr(self, key))} must not be negative")
        if self.stiffness_matrix is not None and self.tilt_stiffness:
            raise ValueError("tilt_stiffness and stiffness_matrix are both given; give one of them")
        if self.stiffness is None and self.stiffness_matrix is None:
            raise ValueError("stiffness is missing; give [x, y, z], or a stiffness_matrix")
        if self.stiffness_matrix is not None and self.stiffness_matrix[5][5] != 0:
            raise ValueError("stiffness_matrix holds the shaft against turning (rz, rz); set that entry to 0")
        return self

    @model_serializer(mode="wrap")
    def _without_unknown_elements(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave rolling elements out where there are none, as rigs of older versions do: hashes depend on it."""
        values: dict[str, Any] = handler(self)
        return values if values.get("rolling") is not None else {k: v for k, v in values.items() if k != "rolling"}

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """(6, 6) stiffness and damping."""
        stiffness = self.stiffness_matrix or np.diag([*(self.stiffness or ()), *[self.tilt_stiffness] * 2, 0.0])
        damping = self.damping_matrix or np.diag([*self.damping, 0.0, 0.0, 0.0])
        return np.array(stiffness, float), np.array(damping, float)


class Coupling(Described):
    """A torsional spring at a shaft's node: to an end machine of some inertia, or to the node of another shaft.

    Torque enters and leaves the rig at end machines. Two coupled shafts turn at one speed.
    """

    shaft: str = Field(description="Name of the shaft.")
    node: int = quantity("-", "Node of the shaft, from 0.", ge=0)
    stiffness: float = quantity("N m/rad", "Torsional stiffness.", gt=0)
    damping: float = quantity("N m s/rad", "Torsional damping.", ge=0, default=0.0)
    inertia: float | None = quantity("kg m^2", "Polar inertia of the end machine.", gt=0, default=None)
    to_shaft: str | None = Field(default=None, description="Name of the other shaft, in place of an end machine.")
    to_node: int = quantity("-", "Node of the other shaft, from 0.", ge=0, default=0)
    lateral_stiffness: Vector = quantity(
        "N/m", "Stiffness between the two shafts along x, y and z of the first.", default=(0.0, 0.0, 0.0)
    )

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.inertia is None) == (self.to_shaft is None):
            raise ValueError("give either the inertia of an end machine, or to_shaft, one of the two")
        return self


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
