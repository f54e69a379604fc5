"""Stiffness of a pair of spur teeth by the energy method: what a unit force along the normal stores in each part.

A tooth bends, shears and is compressed as a cantilever on its root circle, the gear's body yields under it, and the two
flanks flatten. With sections of area A and second moment I at the height y, the contact at (y_c, x_c), and the force at
the angle beta from the perpendicular to the tooth's centre line:

- bending: ``1 / k_b = int (cos(beta) (y_c - y) - x_c sin(beta))^2 / (E I) dy``
- shear: ``1 / k_s = int 1.2 cos(beta)^2 / (G A) dy``
- compression: ``1 / k_a = int sin(beta)^2 / (E A) dy``
- foundation: ``1 / k_f = cos(beta)^2 / (E W) (L (u/S)^2 + M u/S + P (1 + Q tan(beta)^2))``
- contact: ``1 / k_h = 2 (c_1 + c_2) / (pi W)``, c = (1 - nu^2) / E; ``4 (1 - nu^2) / (pi E W)`` for one material

Sources: Yang & Lin 1987, doi:10.1115/1.3267437 (bending, compression, contact); Tian, Zuo, Fyfe 2004,
doi:10.1115/IMECE2004-59444 (shear); Sainsot, Velex, Duverger 2004, doi:10.1115/1.1758252 (foundation); Ma et al. 2014,
doi:10.1016/j.engfailanal.2014.05.018 (from the root circle, fillet included).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.transmission.damage import ToothDamage
from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair
from sigdb.transmission.mesh.tooth_form import ToothForm
from sigdb.transmission.mesh.tooth_sections import ToothSections, broken_off, contact_width, sections

POINTS = 1025
"""Points of contact at which a pair's stiffness is computed; between them it is linear, to 4e-7 of its size."""
_SHEAR = 1.2
_SAINSOT = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)
_HUB_RATIOS = (1.4, 7.0)
SOUND = ToothDamage()


@dataclass(frozen=True, kw_only=True)
class Elastic:
    """Elastic constants of a gear.

    Attributes
    ----------
    young_modulus, shear_modulus
        In Pa.
    """

    young_modulus: float
    shear_modulus: float

    @property
    def contact_compliance(self) -> float:
        """``(1 - nu^2) / E``, 1/Pa."""
        nu = self.young_modulus / (2 * self.shear_modulus) - 1
        return (1 - nu**2) / self.young_modulus


@dataclass(frozen=True, kw_only=True)
class ElasticPair:
    """A pair of spur gears with what their stiffness needs besides the teeth; the driving gear comes first.

    Attributes
    ----------
    geometry
        The pair; helix angle 0.
    materials
        Elastic constants of both gears.
    bores
        Diameters at which the gears' bodies are held, m.
    """

    geometry: CylindricalPair
    materials: tuple[Elastic, Elastic]
    bores: tuple[float, float]

    @cached_property
    def forms(self) -> tuple[ToothForm, ToothForm]:
        """The teeth of both gears."""
        g = self.geometry
        driving, driven = (
            ToothForm(
                teeth=g.teeth[i],
                module=g.normal_module,
                pressure_angle=g.pressure_angle,
                profile_shift=g.profile_shifts[i],
                tip_radius=g.tip_radii[i],
                rack=g.rack,
            )
            for i in (0, 1)
        )
        return driving, driven

    def check(self) -> None:
        """Refuse a pair for which the method does not hold.

        Raises
        ------
        InputError
            If the teeth are helical or undercut, touch below their involutes, or a body is outside the range of its
            formula.
        """
        if self.geometry.helix_angle_deg:
            raise InputError(f"helix_angle_deg = {self.geometry.helix_angle_deg}: the energy method is for spur teeth")
        lowest = (self.curvatures(np.zeros(1))[0], self.curvatures(np.array([self.geometry.contact_ratio]))[1])
        for form, bore, rho in zip(self.forms, self.bores, lowest, strict=True):
            if rho < form.involute_start:
                raise InputError(
                    f"the teeth of the gear of {form.teeth} teeth would touch below their involute; lower the addendum"
                )
            if not _HUB_RATIOS[0] * bore <= 2 * form.root_radius <= _HUB_RATIOS[1] * bore:
                raise InputError(
                    f"bore = {bore}: the root diameter of the gear of {form.teeth} teeth, {2 * form.root_radius:.4g}, "
                    f"must be {_HUB_RATIOS[0]} to {_HUB_RATIOS[1]:g} times its bore, where the foundation's formula "
                    "holds; give the diameter at which the gear's body is held"
                )

    def curvatures(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Radii of curvature of both flanks x passes after first contact, m."""
        rho = self.geometry.first_contact + x * self.geometry.base_pitch
        return rho, self.geometry.line_of_action - rho


@lru_cache(maxsize=512)
def pair_curve(pair: ElasticPair, damage: ToothDamage = SOUND, member: int = 0) -> FloatArray:
    """Stiffness of one pair of teeth at :data:`POINTS` equal steps from first to last contact.

    Parameters
    ----------
    pair
        The gears.
    damage
        If the geometry of a tooth does not hold.
    member
        Whose tooth: 0 the driving gear's, 1 the driven gear's.

    Returns
    -------
    ndarray, (POINTS,)
        N/m, along the normal; read-only.

    Raises
    ------
    InputError
        If the geometry is outside what the method holds for.
    """
    x = np.linspace(0, pair.geometry.contact_ratio, POINTS)
    forms, width = pair.forms, pair.geometry.face_width
    place = damage.pit_place * pair.geometry.contact_ratio
    centre = float(pair.curvatures(np.array(place))[member])
    compliance, touching = np.zeros(POINTS), np.full(POINTS, width)
    for i, rho in enumerate(pair.curvatures(x)):
        tooth_damage = damage if i == member else SOUND
        # Ascending along the tooth, which the driven gear's runs down.
        order = slice(None, None, -1 if i else 1)
        compliance += tooth_compliance(
            forms[i], pair.materials[i], width, pair.bores[i], rho[order], centre, tooth_damage
        )[order]
        if i == member:
            touching = contact_width(forms[i], width, rho, centre, tooth_damage)
    compliance += 2 / np.pi * sum(material.contact_compliance for material in pair.materials) / touching
    stiffness = np.zeros(POINTS) if broken_off(forms[member], damage) else 1 / compliance
    stiffness.flags.writeable = False
    return stiffness


def tooth_compliance(
    form: ToothForm,
    material: Elastic,
    face_width: float,
    bore: float,
    rho: FloatArray,
    centre: float = 0.0,
    damage: ToothDamage = SOUND,
) -> FloatArray:
    """(n,) compliance of a tooth and its foundation, along the normal, at ascending radii of curvature rho, m/N."""
    cut = sections(form, face_width, rho, centre, damage)
    bending, shear, compression = beam_compliances(form, material, rho, cut)
    return bending + shear + compression + foundation_compliance(form, material, face_width, bore, rho)


def beam_compliances(
    form: ToothForm, material: Elastic, rho: FloatArray, cut: ToothSections
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compliances (n,) in bending, shear and compression at ascending radii of curvature rho, m/N."""
    y, x = form.involute(rho)
    sine, cosine = np.sin(form.normal_angle(rho)), np.cos(form.normal_angle(rho))
    # Heights from the root keep the moments' differences exact.
    root = cut.height[0, 0]
    h, arm = cut.height - root, cosine * (y - root) - x * sine
    flexible = cut.weight / cut.inertia
    j0, j1, j2 = (_integrals(flexible * h**n, len(rho)) for n in (0, 1, 2))
    slender = _integrals(cut.weight / cut.area, len(rho))
    bending = (arm**2 * j0 - 2 * arm * cosine * j1 + cosine**2 * j2) / material.young_modulus
    shear = _SHEAR * cosine**2 * slender / material.shear_modulus
    return bending, shear, sine**2 * slender / material.young_modulus


def foundation_compliance(
    form: ToothForm, material: Elastic, face_width: float, bore: float, rho: FloatArray
) -> FloatArray:
    """(n,) compliance of the gear's body under a tooth, m/N."""
    beta = form.normal_angle(rho)
    load_line = form.base_radius / np.cos(beta) - form.root_radius
    theta = form.half_root_angle
    shape = foundation_shape(theta, 2 * form.root_radius / bore, load_line / (2 * form.root_radius * theta), beta)
    return np.cos(beta) ** 2 / (material.young_modulus * face_width) * shape


def foundation_shape(theta: float, hub_ratio: float, u_per_s: FloatArray, beta: FloatArray) -> FloatArray:
    """``L (u/S)^2 + M u/S + P (1 + Q tan(beta)^2)`` of Sainsot et al.

    Parameters
    ----------
    theta
        Half of the angle that the tooth spans on the root circle, rad. The coefficients were fitted for 0.01 to 0.12.
    hub_ratio
        Root radius per radius of the bore.
    u_per_s
        Height above the root circle at which the line of action crosses the tooth's centre line, per length of the
        root's arc ``2 theta`` times root radius.
    beta
        Angle of the force from the perpendicular to the centre line, rad.
    """
    terms = np.array([1 / theta**2, hub_ratio**2, hub_ratio / theta, 1 / theta, hub_ratio, 1.0])
    ell, m, p, q = _SAINSOT @ terms
    return ell * u_per_s**2 + m * u_per_s + p * (1 + q * np.tan(beta) ** 2)


def _integrals(integrand: FloatArray, count: int) -> FloatArray:
    """Integrals from the root to each of the last ``count`` edges of panels."""
    return np.cumsum(integrand.sum(axis=1))[-count:]
