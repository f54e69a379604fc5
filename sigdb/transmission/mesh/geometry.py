"""The geometry of a gear pair: pitch cones, and the one normal along which the mesh is a spring.

Spur, helical, straight bevel and spiral bevel pairs differ only in the normal.
"""

from dataclasses import dataclass

import numpy as np

from sigdb.core import FloatArray, InputError
from sigdb.transmission.parts.gears import Mesh


@dataclass(frozen=True, kw_only=True)
class PairMember:
    """A gear of a pair, as far as the geometry depends on it.

    Attributes
    ----------
    teeth
        Tooth count.
    axis
        (3,) unit vector of its shaft's z axis, in the casing's frame.
    apex
        On which side along ``axis`` the pitch cone's apex lies; None for parallel shafts.
    """

    teeth: int
    axis: FloatArray
    apex: str | None


@dataclass(frozen=True, kw_only=True)
class MeshGeometry:
    """Where and how a pair touches, in the casing's frame.

    Attributes
    ----------
    radii
        Mean pitch radii of the driving and the driven gear, m; those at which they run.
    pitch_angles_deg
        Pitch-cone angles, 0 for parallel shafts.
    normal
        (3,) unit normal at the mesh point: the direction of the force on the driven gear.
    arms
        (2, 3) vectors from each gear's centre to the mesh point, m.
    driven_rotation
        Sense of the driven shaft about its own z axis, 1 right-handed, -1 left-handed.
    force_per_torque
        Static mesh force along the normal for a unit torque on the driving gear,
        ``1 / (r cos(phi_n) cos(psi))``, 1/m.
    sliding
        (3,) unit vector in which the driving tooth slides over the driven one after the pitch point, and against
        which it slides before it.
    base_pitch
        Way of the contact along the normal in a tooth pass, m.
    path
        (3,) way of the contact for a unit of that: in the plane across the pitch element, in which a section of the
        teeth meets, so that it is the normal itself for spur gears.
    """

    radii: tuple[float, float]
    pitch_angles_deg: tuple[float, float]
    normal: FloatArray
    arms: FloatArray
    driven_rotation: int
    force_per_torque: float
    sliding: FloatArray
    base_pitch: float
    path: FloatArray

    @property
    def vector(self) -> FloatArray:
        """(12,) mesh vector h: ``delta = h' q`` is the compression along the normal, m.

        ``q`` holds (translation, rotation) of the driving and then of the driven gear, in the casing's frame;
        the mesh force on them is ``-h k delta``. Relative rotation and relative translation, equation (4) of
        the paper, come together.
        """
        n = self.normal
        r1, r2 = self.arms
        return np.concatenate([n, np.cross(r1, n), -n, -np.cross(r2, n)])

    @property
    def friction(self) -> FloatArray:
        """(2, 12) vectors f0, f1 of friction: a contact ``xi`` behind the pitch point along the normal, with the force
        N and the coefficient mu, puts ``-mu N (sgn(xi) f0 + |xi| f1)`` on the gears.

        f0 acts across the line of action at the pitch point, f1 holds the moments of its arm's growth; together they
        take the power ``mu N |xi| |(omega_1 - omega_2) x path|`` from the rotation.
        """
        t = self.sliding
        r1, r2 = self.arms
        arm, nothing = np.cross(self.path, t), np.zeros(3)
        return np.array(
            [np.concatenate([t, np.cross(r1, t), -t, -np.cross(r2, t)]), np.concatenate([nothing, arm, nothing, -arm])]
        )


def mesh_geometry(mesh: Mesh, driving: PairMember, driven: PairMember, rotation: int) -> MeshGeometry:
    """Geometry of a gear pair.

    The axes a1 and a2 and the pitch element e point away from the apex. The common normal g of the pitch surfaces
    points from the driving to the driven gear, and t is the pitch-line velocity. The tooth's normal is

    ``n = cos(phi) (cos(psi) t - H s sin(psi) e) + sin(phi) g``

    with phi and psi at the pitch circles on which the pair runs, H = 1 for a right-hand driving gear, and s = 1 where
    it turns right-handed about a1. For a bevel pair this gives the axial force
    ``Wt / cos(psi) (tan(phi) sin(gamma) -+ sin(psi) cos(gamma))`` on the driving gear.

    Parameters
    ----------
    mesh
        Module, face width, angles and hand of the pair.
    driving, driven
        The two gears.
    rotation
        Sense of the driving shaft about its own z axis, 1 or -1.

    Raises
    ------
    InputError
        Where the axes, ``apex`` and ``line_of_centres`` contradict each other.
    """
    parallel = np.linalg.norm(np.cross(driving.axis, driven.axis)) < 1e-9
    frame = _parallel if parallel else _bevel
    radii, gammas, a1, e, radial1, radial2 = frame(mesh, driving, driven)
    phi, psi = np.deg2rad(mesh.pressure_angle_deg), np.deg2rad(mesh.helix_angle_deg)
    if parallel and mesh.is_shifted:
        phi, psi = mesh.pair((driving.teeth, driven.teeth)).working_angles

    spin = rotation * float(np.sign(a1 @ driving.axis))
    t = spin * np.cross(a1, radial1)
    g = np.cross(e, np.cross(a1, radial1))
    g *= np.sign(g @ radial1)
    hand = 1.0 if mesh.hand == "right" else -1.0
    n = np.cos(phi) * (np.cos(psi) * t - hand * spin * np.sin(psi) * e) + np.sin(phi) * g

    driven_rotation = int(np.sign(np.cross(driven.axis, radial2) @ t))
    relative = rotation * driving.axis - driven_rotation * driving.teeth / driven.teeth * driven.axis
    sliding = np.cross(relative, n)
    across = n - (n @ e) * e
    lever = radii[0] * np.cos(phi) * np.cos(psi)
    return MeshGeometry(
        radii=radii,
        pitch_angles_deg=(float(np.rad2deg(gammas[0])), float(np.rad2deg(gammas[1]))),
        normal=n,
        arms=np.array([radii[0] * radial1, radii[1] * radial2]),
        driven_rotation=driven_rotation,
        force_per_torque=float(1 / lever),
        sliding=sliding / np.linalg.norm(sliding),
        base_pitch=float(2 * np.pi * lever / driving.teeth),
        path=across / (across @ across),
    )


_Frame = tuple[tuple[float, float], tuple[float, float], FloatArray, FloatArray, FloatArray, FloatArray]


def _parallel(mesh: Mesh, driving: PairMember, driven: PairMember) -> _Frame:
    if mesh.line_of_centres is None:
        raise InputError(
            f"the shafts of {mesh.driving!r} and {mesh.driven!r} are parallel; give the mesh's line_of_centres, "
            "the direction from the driving to the driven gear"
        )
    line = np.asarray(mesh.line_of_centres) - (mesh.line_of_centres @ driving.axis) * driving.axis
    if np.linalg.norm(line) < 1e-9:
        raise InputError(
            f"line_of_centres = {list(mesh.line_of_centres)} lies along the shafts of {mesh.driving!r} and "
            f"{mesh.driven!r}; give the direction from one gear to the other"
        )
    line /= np.linalg.norm(line)
    radii = (mesh.module * driving.teeth / 2, mesh.module * driven.teeth / 2)
    if mesh.is_shifted:
        radii = mesh.pair((driving.teeth, driven.teeth)).working_radii
    return radii, (0.0, 0.0), driving.axis, driving.axis, line, -line


def _bevel(mesh: Mesh, driving: PairMember, driven: PairMember) -> _Frame:
    if mesh.centre_distance is not None:
        raise InputError(
            f"centre_distance = {mesh.centre_distance} is for parallel shafts, and those of {mesh.driving!r} and "
            f"{mesh.driven!r} meet; leave it out"
        )
    for name, gear in ((mesh.driving, driving), (mesh.driven, driven)):
        if gear.apex is None:
            raise InputError(
                f"gears.{name}.apex is missing: its shaft meets the other at an angle, so it is a bevel gear; "
                "say whether the pitch cone's apex lies 'ahead' of it or 'behind' it along its shaft"
            )
    a1 = -driving.axis if driving.apex == "ahead" else driving.axis
    a2 = -driven.axis if driven.apex == "ahead" else driven.axis
    sigma = np.arccos(np.clip(a1 @ a2, -1, 1))
    gamma1 = np.arctan2(np.sin(sigma), driven.teeth / driving.teeth + np.cos(sigma))
    gamma2 = sigma - gamma1
    in_plane = a2 - (a2 @ a1) * a1
    radial1 = in_plane / np.linalg.norm(in_plane)
    e = np.cos(gamma1) * a1 + np.sin(gamma1) * radial1
    radial2 = (e - (e @ a2) * a2) / np.sin(gamma2)

    def mean_radius(teeth: int, gamma: FloatArray) -> float:
        return mesh.module * teeth / 2 - mesh.face_width / 2 * float(np.sin(gamma))

    radii = (mean_radius(driving.teeth, gamma1), mean_radius(driven.teeth, gamma2))
    if min(radii) <= 0:
        raise InputError(
            f"face_width = {mesh.face_width} is too wide for the pitch cones of {mesh.driving!r} and {mesh.driven!r}; "
            "it must be less than the outer cone distance"
        )
    return radii, (float(gamma1), float(gamma2)), a1, e, radial1, radial2
