"""Gears and meshes as they are described in a rig file."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, SerializerFunctionWrapHandler, Tag, model_serializer, model_validator

from sigdb.core import InputError, Vector, quantity, without_defaults
from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair
from sigdb.transmission.mesh.energy_method import Elastic, ElasticPair
from sigdb.transmission.mesh.geometry_profiles import EnergyMethod, GeometryProfile, Iso6336
from sigdb.transmission.mesh.profiles import HarmonicProfile, Table, Trapezoid, kind
from sigdb.transmission.parts.bodies import Body, Rotating, cylinder
from sigdb.transmission.parts.described import Described
from sigdb.transmission.parts.shafts import Material


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


AnyProfile = Annotated[
    Annotated[Trapezoid, Tag("trapezoid")]
    | Annotated[HarmonicProfile, Tag("harmonic")]
    | Annotated[Table, Tag("table")]
    | Annotated[EnergyMethod, Tag("energy-method")]
    | Annotated[Iso6336, Tag("iso-6336")],
    Discriminator(kind),
]
"""The kinds of profile that a mesh can have, distinguished by their key ``kind``."""


def _mean_of_profile(checked: dict[str, Any]) -> float | None:
    """The mean stiffness that a mesh's profile gives; None where it gives none, or not before it knows its gears."""
    profile = checked.get("profile")
    return None if profile is None or isinstance(profile, GeometryProfile) else profile.mean_stiffness


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
    centre_distance: float | None = quantity(
        "m",
        "Parallel shafts: distance of their axes; if left out that at which both flanks touch for the profile shifts.",
        gt=0, default=None,
    )  # fmt: skip
    damping: float = quantity("N s/m", "Viscous damping along the normal.", ge=0, default=0.0)
    backlash: float | None = quantity(
        "m",
        "Way from one flank to the other along the normal, where the teeth part; no contact of the backs if left out.",
        gt=0,
        default=None,
    )
    profile: AnyProfile = Field(description="Stiffness of one tooth pair along its contact.")
    stiffness: float = quantity(
        "N/m", "Mean mesh stiffness along the normal; that of the profile, where it gives one, if left out.",
        gt=0, default_factory=_mean_of_profile,
    )  # fmt: skip
    profile_error: ProfileError | None = Field(default=None, description="Deviation of the tooth profiles.")

    @model_validator(mode="after")
    def _mean_known(self) -> Self:
        if "stiffness" in self.assumed and "stiffness" not in self.model_fields_set:
            raise ValueError(
                "assumed.stiffness: stiffness follows from the profile; state it, or remove the assumption"
            )
        if isinstance(self.profile, GeometryProfile):
            return self
        if self.stiffness is None and self.profile.mean_stiffness is None:
            raise ValueError(
                "stiffness is missing; add it, or a profile that gives it (kind = 'table', 'energy-method', 'iso-6336')"
            )
        return self

    @model_serializer(mode="wrap")
    def _as_given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without a mean stiffness that follows from the profile, so that it follows again."""
        stated = "stiffness" in self.model_fields_set
        dumped = without_defaults(self, handler(self), ("centre_distance",))
        return {name: value for name, value in dumped.items() if name != "stiffness" or stated}

    @property
    def is_shifted(self) -> bool:
        """Whether the pair may run at another distance than the reference one."""
        return self.centre_distance is not None or sum(self.profile.profile_shifts) != 0

    def pair(self, teeth: tuple[int, int]) -> CylindricalPair:
        """Geometry of the pair on parallel shafts, for the teeth of the driving and the driven gear."""
        return CylindricalPair(
            teeth=teeth,
            normal_module=self.module * float(np.cos(np.deg2rad(self.helix_angle_deg))),
            face_width=self.face_width,
            pressure_angle_deg=self.pressure_angle_deg,
            helix_angle_deg=self.helix_angle_deg,
            profile_shifts=self.profile.profile_shifts,
            centre_distance=self.centre_distance,
        )

    def fitted(self, driving: Gear, driven: Gear, materials: Mapping[str, Material]) -> "Mesh":
        """The mesh with a profile that knows its gears, on parallel shafts.

        Raises
        ------
        InputError
            If the profile does not hold for these gears.
        """
        if not isinstance(self.profile, GeometryProfile):
            return self
        elastic = []
        for name, gear in ((self.driving, driving), (self.driven, driven)):
            material = materials.get(self.profile.material or gear.material or "")
            if material is None:
                raise InputError(
                    f"the material of gear {name!r} is not known; give profile.material, one of "
                    f"{', '.join(materials) or 'those of the table materials'}"
                )
            elastic.append(Elastic(young_modulus=material.young_modulus, shear_modulus=material.shear_modulus))
        geometry = self.pair((driving.teeth, driven.teeth))
        pair = ElasticPair(geometry=geometry, materials=(elastic[0], elastic[1]), bores=(driving.bore, driven.bore))
        profile = self.profile.fitted(pair)
        stated = "stiffness" in self.model_fields_set
        changes = {"profile": profile, "stiffness": self.stiffness if stated else profile.mean_stiffness}
        # A copy with the same stated fields, so that the mean follows again when it is read back.
        return self.model_construct(_fields_set=set(self.model_fields_set), **(dict(self) | changes))


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
