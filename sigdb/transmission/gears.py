"""Gears and meshes as they are described in a rig file."""

from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from sigdb.core.fields import Section, Vector, quantity
from sigdb.transmission.described import Described
from sigdb.transmission.shafts import Material


class Gear(Described):
    """A gear: a rigid cylinder of the mean pitch radius on a node of a shaft.

    The body follows the tooth count, since the pitch radius does.
    """

    shaft: str = Field(description="Name of the shaft that carries it.")
    node: int = quantity("-", "Node of the shaft at the middle of the face, from 0.", ge=0)
    teeth: int = quantity("-", "Tooth count.", ge=5)
    body_length: float = quantity("m", "Axial length of the body.", gt=0)
    bore: float = quantity(
        "m", "Diameter of the bore, 0 for a gear made in one piece with its shaft.", ge=0, default=0.0
    )
    material: str = Field(description="Name of its material.")
    apex: Literal["ahead", "behind"] | None = Field(
        default=None,
        description="Bevel gears: on which side of the gear, along its shaft's z, the pitch cone's apex lies.",
    )


class Body(Section):
    """A rigid body at a node."""

    mass: float = quantity("kg", "Mass.", ge=0)
    polar_inertia: float = quantity("kg m^2", "Inertia about the shaft's axis.", ge=0)
    diametral_inertia: float = quantity("kg m^2", "Inertia about a diameter.", ge=0)


def gear_body(gear: Gear, material: Material, pitch_radius: float) -> Body:
    """The rigid body of a gear: a hollow cylinder of its mean pitch radius.

    ``m = rho pi (r^2 - b^2) L``, ``Ip = m (r^2 + b^2) / 2``, ``Id = m (3 (r^2 + b^2) + L^2) / 12``.
    """
    r, b, length = pitch_radius, gear.bore / 2, gear.body_length
    mass = material.density * np.pi * (r**2 - b**2) * length
    return Body(
        mass=float(mass),
        polar_inertia=float(mass * (r**2 + b**2) / 2),
        diametral_inertia=float(mass * (3 * (r**2 + b**2) + length**2) / 12),
    )


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
    profile: Trapezoid = Field(description="Stiffness of one tooth pair along its contact.")


class Operating(Described):
    """The operating point, as seen on the driving machine's shaft."""

    drive: str = Field(description="Name of the coupling through which torque enters.")
    load: str = Field(description="Name of the coupling through which torque leaves.")
    speed_rpm: float = quantity("rpm", "Speed of the drive's shaft.", gt=0)
    torque: float = quantity("N m", "Torque of the drive.", gt=0)
    rotation: Literal[1, -1] = quantity(
        "-", "Sense of the drive's shaft about its z axis: 1 right-handed, -1 left-handed.", default=1
    )
