"""Gears and meshes as they are described in a rig file."""

from typing import Literal, Self

from pydantic import Field, model_validator

from sigdb.core.fields import Vector, quantity
from sigdb.transmission.bodies import Body, Rotating, cylinder
from sigdb.transmission.described import Described


class Gear(Rotating):
    """A gear on a node of a shaft.

    Its body is a cylinder of the mean pitch radius, which follows the tooth count, or is given as numbers.
    """

    teeth: int = quantity("-", "Tooth count.", ge=5)
    body_length: float | None = quantity("m", "Axial length of the body, where no mass is given.", gt=0, default=None)
    bore: float = quantity(
        "m", "Diameter of the bore, 0 for a gear made in one piece with its shaft.", ge=0, default=0.0
    )
    material: str | None = Field(default=None, description="Name of its material.")
    apex: Literal["ahead", "behind"] | None = Field(
        default=None,
        description="Bevel gears: on which side of the gear, along its shaft's z, the pitch cone's apex lies.",
    )
    runout: float = quantity(
        "m", "Amplitude of the error once a revolution, along the mesh normal, of an eccentric gear.", ge=0, default=0.0
    )
    runout_angle_deg: float = quantity(
        "deg", "Angle after the tacho mark at which most material is missing at the mesh.", default=0.0
    )

    @classmethod
    def shape_fields(cls) -> set[str]:
        return {"body_length", "material"}

    def inertia(self, density: float, pitch_radius: float) -> Body:
        """Its inertia; density and mean pitch radius count only where no mass is given."""
        if self.body is not None:
            return self.body
        assert self.body_length is not None
        return cylinder(density, pitch_radius, self.bore / 2, self.body_length)


class ProfileError(Described):
    """Deviation of the tooth profile along the contact, alike for every pair: a parabola.

    ``e(x) = amplitude (2 x / contact_ratio - 1)^2`` for x passes after first contact: tip and root relief.
    """

    amplitude: float = quantity("m", "Material missing at both ends of the contact, along the mesh normal.")


class Trapezoid(Described):
    """Stiffness of one tooth pair along its contact: a rising flank, a plateau, a falling flank.

    The contact is ``contact_ratio`` tooth passes long, each flank ``flank`` passes; flanks are raised cosines,
    so that results converge with the time grid.
    """

    contact_ratio: float = quantity("pass", "Length of one pair's contact, in tooth passes.", ge=1, lt=3)
    flank: float = quantity("pass", "Length of each flank, in tooth passes.", gt=0)

    @model_validator(mode="after")
    def _flanks_fit(self) -> Self:
        if 2 * self.flank > self.contact_ratio:
            raise ValueError(f"flank = {self.flank} must be at most half of contact_ratio = {self.contact_ratio}")
        return self

    @property
    def pitch_point(self) -> float:
        """Place of the pitch point in a pair's contact, in passes after first contact: assumed midway."""
        return self.contact_ratio / 2


class Mesh(Described):
    """A gear pair: straight or spiral bevel where the shafts meet at an angle, else spur or helical."""

    driving: str = Field(description="Name of the driving gear.")
    driven: str = Field(description="Name of the driven gear.")
    module: float = quantity("m", "Transverse module, at the outer end for bevel gears.", gt=0)
    face_width: float = quantity("m", "Face width.", gt=0)
    pressure_angle_deg: float = quantity("deg", "Normal pressure angle.", gt=0, lt=45)
    helix_angle_deg: float = quantity(
        "deg", "Helix angle; for bevel gears the mean spiral angle.", ge=0, lt=60, default=0.0
    )
    hand: Literal["right", "left"] = Field(default="right", description="Hand of the driving gear's teeth.")
    line_of_centres: Vector | None = quantity(
        "-", "Parallel shafts: direction from the driving to the driven gear, in the casing's frame.", default=None
    )
    stiffness: float = quantity("N/m", "Mean mesh stiffness along the normal.", gt=0)
    damping: float = quantity("N s/m", "Viscous damping along the normal.", ge=0, default=0.0)
    backlash: float | None = quantity(
        "m",
        "Way from one flank to the other along the normal, where the teeth part; no contact of the backs if left out.",
        gt=0,
        default=None,
    )
    profile: Trapezoid = Field(description="Stiffness of one tooth pair along its contact.")
    profile_error: ProfileError | None = Field(default=None, description="Deviation of the tooth profiles.")


class Operating(Described):
    """The operating point: speed and torque of the driving machine's shaft, and how the load fluctuates."""

    shaft: str | None = Field(default=None, description="Shaft that the speed is of, where there is no drive.")
    drive: str | None = Field(default=None, description="Name of the coupling through which torque enters.")
    load: str | None = Field(default=None, description="Name of the coupling through which torque leaves.")
    speed_rpm: float = quantity("rpm", "Speed of the drive's shaft.", ge=0)
    torque: float = quantity("N m", "Mean torque of the drive.", ge=0, default=0.0)
    rotation: Literal[1, -1] = quantity(
        "-", "Sense of the drive's shaft about its z axis: 1 right-handed, -1 left-handed.", default=1
    )
    load_fluctuation: float = quantity(
        "-", "Amplitude of the load's fluctuation, as a fraction of its mean.", ge=0, lt=1, default=0.0
    )
    load_order: int = quantity(
        "1/rev", "Cycles of the fluctuation in a revolution of the load's shaft.", ge=1, default=1
    )
    load_angle_deg: float = quantity(
        "deg", "Angle of the load's shaft after its mark at which the load is greatest.", default=0.0
    )

    @model_validator(mode="after")
    def _referred(self) -> Self:
        if (self.drive is None) != (self.load is None):
            raise ValueError("drive and load belong together; give both, or neither and the shaft that speed_rpm is of")
        if (self.shaft is None) == (self.drive is None):
            raise ValueError("give drive and load, or the shaft that speed_rpm is of where no torque goes through")
        return self
