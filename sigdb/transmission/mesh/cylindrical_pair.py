"""Geometry of a pair of cylindrical gears: radii, and the path of contact on the line of action."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from sigdb.core import InputError

_ROUNDING = 1e-6
"""Fraction by which a stated centre distance may be below that without backlash: it is rounded."""

_STEPS = 12
"""Steps of Newton's method, more than double precision takes from any involute up to that of 60 deg."""


@dataclass(frozen=True, kw_only=True)
class Rack:
    """Basic rack, lengths in normal modules; the defaults are profile A of ISO 53.

    Attributes
    ----------
    addendum, dedendum
        Height of the gear's teeth above and below the reference line.
    fillet_radius
        Radius of the rack's rounded tip, which cuts the root fillet.
    """

    addendum: float = 1.0
    dedendum: float = 1.25
    fillet_radius: float = 0.38


@dataclass(frozen=True, kw_only=True)
class CylindricalPair:
    """A pair of external spur or helical gears, in the transverse section; the driving gear comes first.

    Attributes
    ----------
    teeth
        Tooth counts.
    normal_module, face_width
        In m.
    pressure_angle_deg, helix_angle_deg
        Pressure angle of the rack, in the normal section, deg.
    profile_shifts
        In normal modules.
    centre_distance
        In m; if left out that at which the flanks of both sides touch, which is the reference distance where the
        shifts add up to 0. The tips are shortened where the rack's clearance would be less.
    rack
        The basic rack of both gears.

    Examples
    --------
    >>> pair = CylindricalPair(teeth=(19, 48), normal_module=3.175e-3, face_width=0.016, pressure_angle_deg=20.0)
    >>> round(pair.contact_ratio, 5)
    1.64563
    """

    teeth: tuple[int, int]
    normal_module: float
    face_width: float
    pressure_angle_deg: float
    helix_angle_deg: float = 0.0
    profile_shifts: tuple[float, float] = (0.0, 0.0)
    centre_distance: float | None = None
    rack: Rack = field(default_factory=Rack)

    @cached_property
    def _helix(self) -> float:
        return float(np.deg2rad(self.helix_angle_deg))

    @cached_property
    def pressure_angle(self) -> float:
        """Transverse pressure angle of the rack, rad."""
        return float(np.arctan(np.tan(np.deg2rad(self.pressure_angle_deg)) / np.cos(self._helix)))

    @cached_property
    def base_helix(self) -> float:
        """Helix angle on the base cylinder, rad."""
        return float(np.arcsin(np.sin(self._helix) * np.cos(np.deg2rad(self.pressure_angle_deg))))

    @cached_property
    def pitch_radii(self) -> tuple[float, float]:
        """Reference radii, m."""
        z1, z2 = self.teeth
        transverse = self.normal_module / float(np.cos(self._helix))
        return transverse * z1 / 2, transverse * z2 / 2

    @cached_property
    def base_radii(self) -> tuple[float, float]:
        """Base radii, m."""
        r1, r2 = self.pitch_radii
        cosine = float(np.cos(self.pressure_angle))
        return r1 * cosine, r2 * cosine

    @cached_property
    def distance(self) -> float:
        """Centre distance, m.

        Raises
        ------
        InputError
            If the teeth would jam at it.
        """
        least = self.zero_backlash_distance
        if self.centre_distance is None:
            return least
        if self.centre_distance < (1 - _ROUNDING) * least:
            raise InputError(
                f"centre_distance = {self.centre_distance} is less than {least:.7g}, at which both flanks of the teeth "
                "touch; raise it, or lower the profile shifts"
            )
        return self.centre_distance

    @cached_property
    def zero_backlash_distance(self) -> float:
        """Centre distance at which the flanks of both sides touch, m.

        The working pressure angle there has the involute ``inv(alpha_t) + 2 tan(alpha_n) (x_1 + x_2) / (z_1 + z_2)``.
        """
        shift = sum(self.profile_shifts)
        if shift == 0:
            return sum(self.pitch_radii)
        alpha = self.pressure_angle
        involute = np.tan(alpha) - alpha + 2 * np.tan(np.deg2rad(self.pressure_angle_deg)) * shift / sum(self.teeth)
        if involute <= 0:
            raise InputError(
                f"the profile shifts {list(self.profile_shifts)} leave no pressure angle to {self.teeth[0]} and "
                f"{self.teeth[1]} teeth; raise them"
            )
        working = np.cbrt(3 * involute)
        for _ in range(_STEPS):  # Newton's, from the series of the involute
            working -= (np.tan(working) - working - involute) / np.tan(working) ** 2
        return sum(self.base_radii) / float(np.cos(working))

    @cached_property
    def working_radii(self) -> tuple[float, float]:
        """Radii of the pitch circles on which the pair runs, m."""
        z1, z2 = self.teeth
        return self.distance * z1 / (z1 + z2), self.distance * z2 / (z1 + z2)

    @cached_property
    def working_angles(self) -> tuple[float, float]:
        """Normal pressure angle and helix angle on the pitch circles on which the pair runs, rad."""
        transverse = np.arccos(sum(self.base_radii) / self.distance)
        helix = np.arctan(np.tan(self.base_helix) / np.cos(transverse))
        return float(np.arctan(np.tan(transverse) * np.cos(helix))), float(helix)

    @cached_property
    def tip_radii(self) -> tuple[float, float]:
        """Tip radii, m."""
        m, shifts = self.normal_module, self.profile_shifts
        shortening = max(0.0, sum(shifts) * m - (self.distance - sum(self.pitch_radii)))
        r1, r2 = (r + (self.rack.addendum + x) * m - shortening for r, x in zip(self.pitch_radii, shifts, strict=True))
        return r1, r2

    @cached_property
    def line_of_action(self) -> float:
        """Length of the line of action between the base circles, m."""
        return float(np.sqrt(self.distance**2 - sum(self.base_radii) ** 2))

    @cached_property
    def base_pitch(self) -> float:
        """Transverse base pitch, m."""
        return 2 * np.pi * self.base_radii[0] / self.teeth[0]

    @cached_property
    def first_contact(self) -> float:
        """Radius of curvature of the driving tooth where contact begins, at the driven gear's tip, m."""
        return self.line_of_action - _tip_curvature(self.tip_radii[1], self.base_radii[1])

    @cached_property
    def contact_ratio(self) -> float:
        """Transverse contact ratio.

        Raises
        ------
        InputError
            If it is less than 1.
        """
        last = _tip_curvature(self.tip_radii[0], self.base_radii[0])
        ratio = (last - self.first_contact) / self.base_pitch
        if ratio < 1:
            raise InputError(
                f"the contact ratio of {self.teeth[0]} and {self.teeth[1]} teeth is {ratio:.3f}, less than 1; "
                "raise the addendum or the tooth counts, or lower the pressure angle"
            )
        return ratio

    @cached_property
    def overlap_ratio(self) -> float:
        """Overlap ratio of helical teeth."""
        return self.face_width * float(np.sin(self._helix)) / (np.pi * self.normal_module)

    @cached_property
    def pitch_point(self) -> float:
        """Place of the pitch point, in passes after first contact."""
        z1, z2 = self.teeth
        return (self.line_of_action * z1 / (z1 + z2) - self.first_contact) / self.base_pitch


def corner_separation(pair: CylindricalPair) -> tuple[float, float]:
    """Return the curvatures of the gap beyond both ends of the contact, where the corner of a tip is nearest, 1/m.

    The flanks that roll on without the tip's corner would touch; the corner lags on its involute by ``rho y / r_b`` for
    a way y along the line of action. With the relative curvature of the flanks, ``1/rho_1 + 1/rho_2``, it is apart from
    the other flank by ``(rho / r_b)^2 (1/rho_1 + 1/rho_2) y^2 / 2`` to the second order. The first number holds after
    last contact, at the driving gear's corner, the second before first contact, at the driven gear's.

    It is the leading term of corner contact, as in Munro, Morrish & Palmer 1999, "Gear transmission error outside the
    normal path of contact due to corner and top contact", Proc. IMechE C 213.
    """
    length = pair.line_of_action
    driving = _tip_curvature(pair.tip_radii[0], pair.base_radii[0])
    driven = length - pair.first_contact
    last, first = (
        (rho / base) ** 2 * length / (rho * (length - rho)) / 2
        for rho, base in zip((driving, driven), pair.base_radii, strict=True)
    )
    return last, first


def _tip_curvature(tip_radius: float, base_radius: float) -> float:
    return float(np.sqrt(tip_radius**2 - base_radius**2))
