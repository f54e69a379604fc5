"""Validation: published force formulae of spur, helical, straight bevel and spiral bevel gears.

Bevel: The Gleason Works, as in Shigley's Mechanical Engineering Design, section on spiral bevel forces, and KHK,
Gear Forces, table "Forces acting on spiral bevel gears". Positive axial is away from the apex, positive radial is
towards the gear's own axis, clockwise is seen from the back (the large end) of the driver:

    RH clockwise or LH counterclockwise    driver  Wa = Wt/cos(psi) (tan(phi) sin(gamma) - sin(psi) cos(gamma))
                                                   Wr = Wt/cos(psi) (tan(phi) cos(gamma) + sin(psi) sin(gamma))
                                           driven  the same with the other signs and its own pitch angle
    RH counterclockwise or LH clockwise    both signs reversed.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission.mesh.geometry import PairMember, mesh_geometry
from sigdb.transmission.parts.gears import Mesh, Trapezoid

PROFILE = Trapezoid(contact_ratio=1.5, flank=0.3)


def a_mesh(pressure_angle_deg, angle_deg, hand, **more):
    return Mesh(
        driving="a",
        driven="b",
        module=0.005,
        face_width=0.025,
        pressure_angle_deg=pressure_angle_deg,
        helix_angle_deg=angle_deg,
        hand=hand,
        stiffness=1e8,
        profile=PROFILE,
        **more,
    )


@pytest.mark.parametrize("spiral_deg", [0.0, 35.0])
@pytest.mark.parametrize("shaft_angle_deg", [70.0, 90.0, 105.0])
@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize("apex", ["behind", "ahead"])
def test_bevel_axial_and_radial_forces_of_driver_and_driven(spiral_deg, shaft_angle_deg, hand, clockwise, apex):
    phi, psi, sigma = np.deg2rad([22.5, spiral_deg, shaft_angle_deg])
    outward1, outward2 = np.array([0.0, 0.0, 1.0]), np.array([np.sin(sigma), 0.0, np.cos(sigma)])
    z_axis = outward1 if apex == "behind" else -outward1
    # Seen from the back, a clockwise rotation points from the eye to the apex: against the outward axis.
    spin_about_outward = -1 if clockwise else 1
    rotation = spin_about_outward * int(np.sign(z_axis @ outward1))
    first = PairMember(teeth=12, axis=z_axis, apex=apex)
    second = PairMember(teeth=36, axis=outward2, apex="behind")
    geometry = mesh_geometry(a_mesh(22.5, spiral_deg, hand), first, second, rotation)

    tangential = 1000.0
    torque = tangential * geometry.radii[0]
    on_driven = torque * geometry.force_per_torque * geometry.normal
    sign = 1.0 if clockwise == (hand == "right") else -1.0

    gammas = np.arctan2(np.sin(sigma), [3 + np.cos(sigma), 1 / 3 + np.cos(sigma)])
    inward = [-geometry.arms[i] / geometry.radii[i] for i in (0, 1)]
    for force, outward, to_axis, gamma, s in (
        (-on_driven, outward1, inward[0], gammas[0], -sign),
        (on_driven, outward2, inward[1], gammas[1], sign),
    ):
        axial = tangential / np.cos(psi) * (np.tan(phi) * np.sin(gamma) + s * np.sin(psi) * np.cos(gamma))
        radial = tangential / np.cos(psi) * (np.tan(phi) * np.cos(gamma) - s * np.sin(psi) * np.sin(gamma))
        assert_allclose(force @ outward, axial, rtol=1e-10, atol=1e-9)
        assert_allclose(force @ to_axis, radial, rtol=1e-10, atol=1e-9)
    assert_allclose(np.linalg.norm(on_driven), tangential / (np.cos(phi) * np.cos(psi)), rtol=1e-12)
    pitch_line = spin_about_outward * np.cross(outward1, -inward[0])
    assert_allclose(on_driven @ pitch_line, tangential, rtol=1e-10)


@pytest.mark.parametrize("helix_deg", [0.0, 20.0])
@pytest.mark.parametrize("hand", ["right", "left"])
@pytest.mark.parametrize("rotation", [1, -1])
def test_spur_and_helical_forces(helix_deg, hand, rotation):
    """Wr = Wt tan(phi_n) / cos(psi), Wa = Wt tan(psi); a right-hand driver is thrust along its rotation vector."""
    phi, psi = np.deg2rad([20.0, helix_deg])
    axis = np.array([0.0, 0.0, 1.0])
    member = PairMember(teeth=20, axis=axis, apex=None)
    mesh = a_mesh(20.0, helix_deg, hand, line_of_centres=(1.0, 0.0, 0.0))
    geometry = mesh_geometry(mesh, member, PairMember(teeth=40, axis=axis, apex=None), rotation)
    tangential = 1000.0
    on_driver = -tangential * geometry.radii[0] * geometry.force_per_torque * geometry.normal

    along_rotation = on_driver @ axis * rotation
    assert_allclose(along_rotation, tangential * np.tan(psi) * (1 if hand == "right" else -1), atol=1e-9)
    assert_allclose(-on_driver[0], tangential * np.tan(phi) / np.cos(psi), rtol=1e-12)
    assert_allclose(-on_driver[1] * rotation, tangential, rtol=1e-12)
