"""Sizes of what is not numbers, by rules of machine design: each the usual size, none a proof of strength."""

from dataclasses import dataclass

import numpy as np

from sigdb.core import InputError
from sigdb.transmission.mesh.cylindrical_pair import CylindricalPair
from sigdb.transmission.mesh.iso_6336 import iso_mesh_stiffness

MODULES = (0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 32.0)
"""Modules after series I of ISO 54, mm; below 1 mm after that of DIN 780-1, which agrees with it from 1 mm on."""
PRESSURE_ANGLE_DEG = 20.0
ALLOWABLE_BENDING = 2.5e8
"""Root stress for which teeth are sized, Pa: case-hardened steel with a safety of 1.5 to 2."""
GREATEST_BENDING = 8e8
"""Root stress beyond which no tooth of steel lasts, Pa."""
_STRESS_FACTOR = 6.5
"""Form, stress concentration and application together: 4.3 x 1.5."""
ALLOWABLE_SHEAR = 2.5e7
"""Torsional shear for which shafts are sized, Pa; it leaves room for bending."""
_LEAST_CONTACT = 1.2
_MOST_COMPRESSION = 8e-5
_STEEL_DENSITY = 7850.0


@dataclass(frozen=True, kw_only=True)
class StageSize:
    """Sizes of a stage.

    Attributes
    ----------
    teeth
        Tooth counts of the driving and the driven gear.
    torque
        Torque of the driving gear, N m.
    module
        Normal module, m.
    face_width, least_width, most_width
        Face width and its range, m.
    helix_angle_deg
        Helix angle.
    contact_ratio
        Transverse contact ratio of the standard rack.
    bending
        Root stress, Pa.
    damping
        Damping of the mesh along the normal, N s/m: 0.1 of the critical one of the gears as solid disks.
    relief
        Tip relief, m: the deflection of one pair of teeth under the torque by c' of ISO 6336.
    """

    teeth: tuple[int, int]
    torque: float
    module: float
    face_width: float
    least_width: float
    most_width: float
    helix_angle_deg: float
    contact_ratio: float
    bending: float
    damping: float
    relief: float

    @property
    def transverse_module(self) -> float:
        """Module in the plane of rotation, m."""
        return self.module / float(np.cos(np.deg2rad(self.helix_angle_deg)))

    @property
    def diameters(self) -> tuple[float, float]:
        """Pitch diameters, m."""
        return self.transverse_module * self.teeth[0], self.transverse_module * self.teeth[1]

    @property
    def normal_force(self) -> float:
        """Force along the normal of the teeth, N."""
        tangential = 2 * self.torque / self.diameters[0]
        angles = np.deg2rad([PRESSURE_ANGLE_DEG, self.helix_angle_deg])
        return tangential / float(np.prod(np.cos(angles)))


def size_stage(
    teeth: tuple[int, int], torque: float, helix_angle_deg: float, module: float | None, label: str
) -> StageSize:
    """Return the sizes of a stage whose teeth bear the torque.

    Raises
    ------
    InputError
        If they would break, or no module of a usual machine is enough.
    """
    cosine = float(np.cos(np.deg2rad(helix_angle_deg)))
    needed = (2 * torque * _STRESS_FACTOR * cosine / (teeth[0] * 12 * ALLOWABLE_BENDING)) ** (1 / 3)
    if module is None:
        module = next((size * 1e-3 for size in MODULES if size * 1e-3 >= needed), None)
        if module is None:
            raise InputError(
                f"{label}: a torque of {torque:.4g} N m asks for a module of {needed * 1e3:.3g} mm, more than the "
                f"{MODULES[-1]:g} mm of usual machines; lower the torque, or give module"
            )
    pair = CylindricalPair(
        teeth=teeth, normal_module=module, face_width=module, pressure_angle_deg=PRESSURE_ANGLE_DEG,
        helix_angle_deg=helix_angle_deg,
    )  # fmt: skip
    if pair.contact_ratio < _LEAST_CONTACT:
        raise InputError(
            f"{label}: the transverse contact ratio of {teeth[0]}/{teeth[1]} teeth is {pair.contact_ratio:.3f}, "
            f"less than {_LEAST_CONTACT} of usual machines; raise the tooth counts, or lower the helix angle"
        )
    force = 2 * torque * cosine / (module * teeth[0])
    wanted = float(np.clip(force * _STRESS_FACTOR / (module**2 * ALLOWABLE_BENDING), 10, 25)) * module
    width = rounded(wanted)
    stress = force * _STRESS_FACTOR / (width * module)
    if stress > GREATEST_BENDING or force / width / 1.3e10 > _MOST_COMPRESSION:
        enough = next((size for size in MODULES if size * 1e-3 >= needed), None)
        remedy = f"a module of {enough:g} mm bears it" if enough else "lower it"
        raise InputError(
            f"{label}: a torque of {torque:.4g} N m bends teeth of module {module * 1e3:g} mm by "
            f"{stress / 1e6:.3g} MPa, more than steel bears; {remedy}"
        )
    return StageSize(
        teeth=teeth, torque=torque, module=module, face_width=width, least_width=rounded(0.7 * width),
        most_width=rounded(1.4 * width), helix_angle_deg=helix_angle_deg,
        contact_ratio=pair.contact_ratio, bending=stress, damping=rounded(_mesh_damping(pair, width)),
        relief=rounded(max(force / np.cos(pair.pressure_angle) / (iso_mesh_stiffness(pair).single * width), 1e-8)),
    )  # fmt: skip


def _mesh_damping(pair: CylindricalPair, width: float) -> float:
    """Damping of a tenth of the critical one, N s/m, for two solid disks on a mesh of a width."""
    stiffness = iso_mesh_stiffness(pair).mean * width / np.cos(pair.base_helix) ** 2
    flexibility = 0.0  # of the discs to a force along the normal: base radius^2 / inertia, 1/kg
    for pitch, base in zip(pair.pitch_radii, pair.base_radii, strict=True):
        flexibility += 2 * (base * np.cos(pair.base_helix) / pitch) ** 2 / disk_mass(2 * pitch, width)
    return float(2 * 0.1 * np.sqrt(stiffness / flexibility))


def shaft_diameter(torque: float, gears: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the diameter of a shaft and the greatest that its gears leave room for, m.

    Parameters
    ----------
    torque
        Torque that it carries, N m.
    gears
        Pitch diameter and normal module of each gear on it, m.
    """
    by_torque = (16 * torque / (np.pi * ALLOWABLE_SHEAR)) ** (1 / 3)
    by_gears = 0.1 * max(diameter for diameter, _ in gears)
    room = min(0.7 * (diameter - 2.5 * module) for diameter, module in gears)
    return rounded(min(max(by_torque, by_gears), room / 1.3)), room


def bearing_stiffness(bore: float, load: float) -> float:
    """Return the radial stiffness of a ball bearing, N/m, by a formula [1]_ after Kraemer, for nine balls of 0.3 bores.

    It is that along the load. Across the load it is about half as great, which the ranges of new rigs hold. The load is
    at least a hundredth of the dynamic capacity, of about 2e7 Pa on the bore squared, as makers ask for.

    References
    ----------
    .. [1] M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, "Dynamics of Rotating Machines", Cambridge, 2010,
           section on rolling-element bearings; E. Kraemer, "Dynamics of Rotors and Foundations", Springer, 1993.

    Examples
    --------
    >>> round(bearing_stiffness(0.025, 800.0) / 1e8, 2)
    1.02
    """
    return float(13e6 * 9 ** (2 / 3) * (0.3 * bore * max(load, 2e5 * bore**2)) ** (1 / 3))


def machine_inertia(torque: float) -> float:
    """Return the inertia of a machine of some torque, kg m^2: that of catalogues of four-pole induction motors.

    Examples
    --------
    >>> round(machine_inertia(49.0), 3)
    0.035
    """
    return float(min(1.5e-4 * torque**1.4, 1000.0))


def disk_mass(diameter: float, width: float) -> float:
    """Return the mass of a solid disk of steel, kg."""
    return float(_STEEL_DENSITY * np.pi / 4 * diameter**2 * width)


def rounded(value: float) -> float:
    """Return a number rounded to three digits.

    Examples
    --------
    >>> rounded(0.0123456)
    0.0123
    """
    return float(f"{value:.3g}")
