"""Profiles that follow from the geometry of a pair of cylindrical gears, and with them the mean mesh stiffness."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr, field_validator

from sigdb.core import FloatArray, InputError, quantity
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair, Rack, corner_separation
from sigdb.transmission.mesh.energy_method import POINTS, SOUND, ElasticPair, pair_curve
from sigdb.transmission.mesh.iso_6336 import iso_mesh_stiffness
from sigdb.transmission.mesh.profiles import Profile, Values, area, check_contact, raised_cosine, smooth_ends, trapezoid
from sigdb.transmission.mesh.tooth_sections import is_missing


class GeometryProfile(Profile):
    """A profile that learns the geometry of its pair from the rig that it is part of."""

    flank: float = quantity(
        "pass", "Length over which a pair takes up and gives up its load, half of it outside the ideal contact.",
        gt=0, default=0.1,
    )  # fmt: skip
    addendum: float = quantity("-", "Addendum of the teeth, in normal modules.", gt=0, default=1.0)
    dedendum: float = quantity("-", "Dedendum of the teeth, in normal modules.", gt=0, default=1.25)
    profile_shift: float | Values = quantity(
        "-",
        "Profile shifts of the driving and the driven gear in normal modules; a single number is that of the driving "
        "gear, whose mate then has the opposite.",
        default=0.0,
    )
    material: str | None = Field(default=None, description="Name of the teeth's material; the gears' own if left out.")

    _elastic: ElasticPair | None = PrivateAttr(None)

    def fitted(self, pair: ElasticPair) -> Self:
        """The profile of a pair, whose rack and shifts are those of the profile.

        Raises
        ------
        ValueError
            If it does not hold for that pair.
        """
        profile = self.model_copy()
        geometry = replace(pair.geometry, profile_shifts=self.profile_shifts, rack=self.rack)
        profile._elastic = replace(pair, geometry=geometry)
        check_contact(profile.ideal_contact, self.flank)
        return profile

    @field_validator("profile_shift")
    @classmethod
    def _of_two_gears(cls, shift: float | Values) -> float | Values:
        if isinstance(shift, tuple) and len(shift) != 2:
            raise ValueError(f"{list(shift)} has {len(shift)} values; give one for each gear of the pair, two in all")
        return shift

    @property
    def profile_shifts(self) -> tuple[float, float]:
        """Profile shifts of the driving and the driven gear, in normal modules."""
        if isinstance(self.profile_shift, tuple):
            return self.profile_shift[0], self.profile_shift[1]
        return self.profile_shift, -self.profile_shift

    @property
    def elastic(self) -> ElasticPair:
        """The pair with its materials."""
        if self._elastic is None:
            raise InputError("this profile follows from the geometry of its gears; make the mesh part of a rig first")
        return self._elastic

    @property
    def pair(self) -> CylindricalPair:
        """Geometry of the pair."""
        return self.elastic.geometry

    @property
    def rack(self) -> Rack:
        """The basic rack of both gears."""
        return Rack(addendum=self.addendum, dedendum=self.dedendum)

    @property
    def ideal_contact(self) -> float:
        """Length of a pair's contact without its flanks, in passes."""
        return self.pair.contact_ratio

    @property
    def contact_ratio(self) -> float:
        """Length of a pair's contact, in passes: the ideal one and half a flank at each end."""
        return self.ideal_contact + self.flank

    @property
    def pitch_point(self) -> float:
        """Place of the pitch point, in passes after first contact."""
        return self.pair.pitch_point + self.flank / 2


class EnergyMethod(GeometryProfile):
    """Stiffness of a pair of spur teeth by the energy method: bending, shear, compression, foundation and contact.

    The contact begins and ends within a flank whose middle is at the ends of the ideal contact. The mesh's
    ``stiffness`` may be left out: its mean is then the method's. Damage may be given by its geometry.
    """

    kind: Literal["energy-method"] = quantity("-", "Kind of profile.", default="energy-method")
    fillet_radius: float = quantity(
        "-", "Radius of the rack's rounded tip, which cuts the root fillet, in modules.", gt=0, default=0.38
    )

    _damage: ToothDamage = PrivateAttr(SOUND)
    _member: int = PrivateAttr(0)

    @property
    def rack(self) -> Rack:
        """The basic rack of both gears."""
        return Rack(addendum=self.addendum, dedendum=self.dedendum, fillet_radius=self.fillet_radius)

    def fitted(self, pair: ElasticPair) -> Self:
        """The profile of a pair, whose rack and shifts are those of the profile.

        Raises
        ------
        ValueError
            If the method does not hold for that pair.
        """
        profile = super().fitted(pair)
        profile.elastic.check()
        return profile

    @property
    def mean_stiffness(self) -> float:
        """Mean mesh stiffness, N/m."""
        return _mean(self.elastic, self.flank)

    def damaged(self, damage: ToothDamage, teeth: int, driving: bool | None) -> Self:
        """The profile of a pair of which a tooth's geometry is damaged, on the gear of that many teeth.

        Raises
        ------
        InputError
            If the damage does not fit the tooth, or it is not clear whose tooth is meant.
        """
        both = self.pair.teeth
        if driving is None and both[0] == both[1]:
            raise InputError(f"both gears have {teeth} teeth; say with driving which of them is damaged")
        width = self.pair.face_width
        if damage.pits * damage.pit_diameter > width:
            raise InputError(
                f"pits = {damage.pits} of pit_diameter = {damage.pit_diameter} do not fit in a row on the face width, "
                f"{width} m; give fewer or smaller ones"
            )
        profile = self.model_copy()
        profile._damage = damage.geometry
        profile._member = both.index(teeth) if driving is None else int(not driving)
        return profile

    def pair_stiffness(self, x: FloatArray) -> FloatArray:
        """Stiffness of a pair at x passes after first contact; that of the neighbours' corners for a missing tooth."""
        if self._is_missing:
            leaving, entering = self._neighbours(x)
            sound = _curve(self.elastic, SOUND, 0)
            ends = sound(np.array([self.ideal_contact, 0.0]))
            return (leaving * ends[0] + entering * ends[1]) / self.mean_stiffness
        curve = _curve(self.elastic, self._damage, self._member)
        return smooth_ends(curve, x, self.contact_ratio, self.flank) / self.mean_stiffness

    def separation(self, x: FloatArray) -> FloatArray:
        """Deviation of the flanks from contact at x passes after first contact, m: wear, or a missing tooth's gap."""
        if not self._is_missing:
            return np.full_like(x, self._damage.wear_depth)
        after_end, before_begin = x + 1 - self.flank / 2 - self.ideal_contact, 1 + self.flank / 2 - x
        leaving, entering = (
            curvature * (np.maximum(passes, 0) * self.pair.base_pitch) ** 2
            for curvature, passes in zip(corner_separation(self.pair), (after_end, before_begin), strict=True)
        )
        handed_over = self._handed_over(x)
        return (1 - handed_over) * leaving + handed_over * entering

    @property
    def _is_missing(self) -> bool:
        return is_missing(self.elastic.forms[self._member], self._damage)

    def _neighbours(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Windows in which the teeth before and behind a missing one touch with their corners."""
        left = 1 - raised_cosine((self.contact_ratio - x - 1) / self.flank)
        not_entered = 1 - raised_cosine((x - 1) / self.flank)
        handed_over = self._handed_over(x)
        return left * (1 - handed_over), not_entered * handed_over

    def _handed_over(self, x: FloatArray) -> FloatArray:
        """From 0 to 1 in the middle of a missing tooth's contact, over a flank."""
        return raised_cosine((x - self.contact_ratio / 2) / self.flank + 0.5)


class Iso6336(GeometryProfile):
    """Mean mesh stiffness c_gamma_alpha by ISO 6336-1, with a trapezoid over the pair's contact as its shape.

    The trapezoid has the length of the contact from the pair's transverse and overlap ratios. The stiffness is along
    the normal: ``c_gamma_alpha b / cos(beta_b)^2``, since the standard's is in the transverse plane.
    """

    kind: Literal["iso-6336"] = quantity("-", "Kind of profile.", default="iso-6336")
    blank_factor: float = quantity(
        "-", "C_R of the standard: 1 for solid disks, less for gears with a thin web.", gt=0, le=1, default=1.0
    )
    line_load: float | None = quantity(
        "N/m",
        "Tangential load for a face width of 1, application factor included; below 1e5 N/m stiffness falls with it.",
        gt=0, default=None,
    )  # fmt: skip

    @property
    def ideal_contact(self) -> float:
        """Length of a pair's contact without its flanks, in passes."""
        return self.pair.contact_ratio + self.pair.overlap_ratio

    @property
    def mean_stiffness(self) -> float:
        """Mean mesh stiffness along the normal, N/m."""
        pair = self.pair
        driving, driven = (material.young_modulus for material in self.elastic.materials)
        stiffness = iso_mesh_stiffness(
            pair, young_moduli=(driving, driven), blank_factor=self.blank_factor, line_load=self.line_load
        )
        return stiffness.mean * pair.face_width / float(np.cos(pair.base_helix)) ** 2

    def pair_stiffness(self, x: FloatArray) -> FloatArray:
        """Stiffness of a pair at x passes after first contact."""
        pair = self.pair
        return trapezoid(x, self.contact_ratio, min(pair.contact_ratio, pair.overlap_ratio + self.flank))


def _curve(pair: ElasticPair, damage: ToothDamage, member: int) -> Callable[[FloatArray], FloatArray]:
    stiffness = pair_curve(pair, damage, member)
    places = np.linspace(0, pair.geometry.contact_ratio, POINTS)
    return lambda place: np.interp(place, places, stiffness)


@lru_cache(maxsize=64)
def _mean(pair: ElasticPair, flank: float) -> float:
    return area(_curve(pair, SOUND, 0), pair.geometry.contact_ratio + flank, flank)
