"""The outline of a spur tooth: the involute flank, and the fillet that the rack's rounded tip cuts.

Coordinates: y from the gear's centre along the tooth's centre line, x from the centre line to the loaded flank. The
radius of curvature rho describes the involute. The angle gamma of the rack's tip from the pitch line describes the
fillet: it is the pressure angle where the fillet meets the involute, 90 deg where it meets the root circle.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.transmission.mesh.cylindrical_pair import Rack


@dataclass(frozen=True, kw_only=True)
class ToothForm:
    """A spur tooth that a rack generates, whether its base circle lies outside its root circle or inside.

    Source of the fillet's equations: Ma, Song, Pang, Wen (2014), doi:10.1016/j.engfailanal.2014.05.018.

    Attributes
    ----------
    teeth, module, profile_shift, tip_radius
        Tooth count and sizes of the gear; lengths in m, the shift in modules.
    pressure_angle
        In rad.
    rack
        The basic rack.
    """

    teeth: int
    module: float
    pressure_angle: float
    profile_shift: float
    tip_radius: float
    rack: Rack

    @cached_property
    def pitch_radius(self) -> float:
        """Reference radius, m."""
        return self.module * self.teeth / 2

    @cached_property
    def base_radius(self) -> float:
        """Base radius, m."""
        return self.pitch_radius * float(np.cos(self.pressure_angle))

    @cached_property
    def root_radius(self) -> float:
        """Root radius, m."""
        return self.pitch_radius - (self.rack.dedendum - self.profile_shift) * self.module

    @cached_property
    def half_base_angle(self) -> float:
        """Half of the angle that the tooth's flanks span on the base circle, rad."""
        alpha = self.pressure_angle
        thickness = np.pi / 2 + 2 * self.profile_shift * np.tan(alpha)
        return float(thickness / self.teeth + np.tan(alpha) - alpha)

    @cached_property
    def half_root_angle(self) -> float:
        """Half of the angle that the tooth spans on the root circle, fillets included, rad."""
        return self._centre[1] / self.pitch_radius

    @cached_property
    def _centre(self) -> tuple[float, float]:
        """Centre of the rack's rounded tip: depth below the pitch line, distance from the tooth's centre line, m."""
        rack, alpha = self.rack, self.pressure_angle
        straight = rack.dedendum - rack.fillet_radius
        across = np.pi / 4 + straight * np.tan(alpha) + rack.fillet_radius / np.cos(alpha)
        return (straight - self.profile_shift) * self.module, float(across) * self.module

    @cached_property
    def involute_start(self) -> float:
        """Radius of curvature where the involute begins, m.

        Raises
        ------
        InputError
            If the rack undercuts the tooth.
        """
        rack, sine = self.rack, float(np.sin(self.pressure_angle))
        flank_end = rack.dedendum - rack.fillet_radius * (1 - sine) - self.profile_shift
        start = self.pitch_radius * sine - flank_end * self.module / sine
        if start < 0:
            raise InputError(
                f"a gear of {self.teeth} teeth is undercut by its rack, for which there is no energy method here; "
                f"give it at least {int(np.ceil(2 * flank_end / sine**2))} teeth or more profile shift"
            )
        return start

    @cached_property
    def tip_curvature(self) -> float:
        """Radius of curvature at the tip, m."""
        return float(np.sqrt(self.tip_radius**2 - self.base_radius**2))

    def normal_angle(self, rho: FloatArray) -> FloatArray:
        """Angle of the involute's normal from the perpendicular to the tooth's centre line, rad."""
        return rho / self.base_radius - self.half_base_angle

    def involute(self, rho: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points (y, x) of the flank at radii of curvature rho, m."""
        beta, r = self.normal_angle(rho), self.base_radius
        return r * np.cos(beta) + rho * np.sin(beta), rho * np.cos(beta) - r * np.sin(beta)

    def fillet(self, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points (y, x) of the fillet, m."""
        depth, across = self._centre
        phi = (depth / np.tan(gamma) + across) / self.pitch_radius
        reach = depth / np.sin(gamma) + self.rack.fillet_radius * self.module
        r = self.pitch_radius
        return r * np.cos(phi) - reach * np.sin(gamma - phi), r * np.sin(phi) - reach * np.cos(gamma - phi)

    def fillet_slope(self, gamma: FloatArray) -> FloatArray:
        """``dy / dgamma`` of the fillet, m."""
        depth, across = self._centre
        r = self.pitch_radius
        phi = (depth / np.tan(gamma) + across) / r
        d_phi = -depth / np.sin(gamma) ** 2 / r
        reach = depth / np.sin(gamma) + self.rack.fillet_radius * self.module
        d_reach = -depth * np.cos(gamma) / np.sin(gamma) ** 2
        turned = gamma - phi
        return -r * np.sin(phi) * d_phi - d_reach * np.sin(turned) - reach * np.cos(turned) * (1 - d_phi)

    def fillet_inclination(self, gamma: FloatArray) -> FloatArray:
        """Angle of the fillet's tangent from the tooth's centre line, rad: 30 deg where roots usually crack."""
        depth, across = self._centre
        return gamma - (depth / np.tan(gamma) + across) / self.pitch_radius
