"""Unit: radii, arms, speeds and the balance of forces, power and moments of a gear pair."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from sigdb.core.errors import InputError
from sigdb.transmission.mesh.geometry import PairMember, mesh_geometry
from sigdb.transmission.parts.gears import Mesh, Trapezoid

PROFILE = Trapezoid(contact_ratio=1.5, flank=0.3)


def a_mesh(**changes):
    given = {"module": 0.005, "face_width": 0.025, "pressure_angle_deg": 20.0, "stiffness": 1e8, "profile": PROFILE}
    return Mesh(driving="a", driven="b", **(given | changes))


def parallel_pair(frame=None, flip=1.0, rotation=1, line=(1.0, 0.0, 0.0), **changes):
    """Teeth 20/45 on shafts along z, the second shaft's z turned over where flip is -1."""
    frame = np.eye(3) if frame is None else frame
    first = PairMember(teeth=20, axis=frame @ [0.0, 0.0, 1.0], apex=None)
    second = PairMember(teeth=45, axis=frame @ [0.0, 0.0, flip], apex=None)
    mesh = a_mesh(line_of_centres=tuple(frame @ line), **changes)
    return mesh, mesh_geometry(mesh, first, second, rotation), first, second


def bevel_pair(angle_deg=90.0, apexes=("behind", "behind"), frame=None, rotation=1, **changes):
    """Teeth 15/35 with outward axes at angle_deg; a shaft whose apex lies ahead points towards it."""
    frame = np.eye(3) if frame is None else frame
    outward = [frame @ [0.0, 0.0, 1.0], frame @ [np.sin(np.deg2rad(angle_deg)), 0.0, np.cos(np.deg2rad(angle_deg))]]
    members = [
        PairMember(teeth=teeth, axis=axis if apex == "behind" else -axis, apex=apex)
        for teeth, axis, apex in zip((15, 35), outward, apexes, strict=True)
    ]
    mesh = a_mesh(**changes)
    return mesh, mesh_geometry(mesh, *members, rotation), *members


PAIRS = [
    pytest.param(make, options, id=f"{make.__name__}-{i}")
    for i, (make, options) in enumerate(
        [
            (parallel_pair, {}),
            (parallel_pair, {"helix_angle_deg": 25.0}),
            (parallel_pair, {"helix_angle_deg": 25.0, "hand": "left", "rotation": -1, "flip": -1.0}),
            (parallel_pair, {"centre_distance": 0.165}),
            (parallel_pair, {"centre_distance": 0.165, "helix_angle_deg": 25.0, "hand": "left"}),
            (parallel_pair, {"helix_angle_deg": 25.0, "frame": Rotation.from_rotvec([0.3, -0.8, 1.1]).as_matrix()}),
            (bevel_pair, {}),
            (bevel_pair, {"helix_angle_deg": 35.0}),
            (bevel_pair, {"helix_angle_deg": 35.0, "hand": "left", "rotation": -1}),
            (bevel_pair, {"helix_angle_deg": 35.0, "apexes": ("ahead", "behind")}),
            (bevel_pair, {"helix_angle_deg": 35.0, "apexes": ("behind", "ahead"), "angle_deg": 75.0}),
            (bevel_pair, {"helix_angle_deg": 35.0, "apexes": ("ahead", "ahead"), "angle_deg": 110.0, "rotation": -1}),
            (bevel_pair, {"helix_angle_deg": 35.0, "frame": Rotation.from_rotvec([1.0, 0.4, -0.6]).as_matrix()}),
        ]
    )
]


@pytest.mark.parametrize(("make", "options"), PAIRS)
def test_action_and_reaction_balance_in_force_and_moment(make, options):
    """Forces add to zero, and so do moments about the one mesh point: each member's is the arm's alone."""
    _, geometry, _, _ = make(**options)
    f1, m1, f2, m2 = geometry.vector.reshape(4, 3)
    assert_allclose(f1 + f2, 0, atol=1e-15)
    assert_allclose(np.linalg.norm(geometry.normal), 1, rtol=1e-14)
    assert_allclose(m1, np.cross(geometry.arms[0], f1), atol=1e-15)
    assert_allclose(m2, np.cross(geometry.arms[1], f2), atol=1e-15)


@pytest.mark.parametrize(("make", "options"), PAIRS)
def test_the_trains_free_rotation_compresses_nothing(make, options):
    """Equal pitch-line velocity: the driven gear turns at the ratio of teeth, in the sense that is returned."""
    _, geometry, first, second = make(**options)
    turning = np.zeros(12)
    turning[3:6] = options.get("rotation", 1) * first.axis
    turning[9:12] = geometry.driven_rotation * first.teeth / second.teeth * second.axis
    assert_allclose(geometry.vector @ turning, 0, atol=1e-14)
    one_alone = turning * np.repeat([1, 0], 6)
    assert geometry.vector @ one_alone > 0, "the driving gear's own turning closes the mesh"


@pytest.mark.parametrize(("make", "options"), PAIRS)
def test_force_per_torque_balances_the_driving_torque(make, options):
    """W r cos(phi) cos(psi) = T, and the resultant is W = Wt / (cos(phi) cos(psi))."""
    mesh, geometry, first, _ = make(**options)
    own_axis = options.get("rotation", 1) * first.axis
    assert_allclose(geometry.vector[3:6] @ own_axis * geometry.force_per_torque, 1, rtol=1e-13)
    cosines = np.cos(np.deg2rad(20)) * np.cos(np.deg2rad(mesh.helix_angle_deg))
    reference = mesh.module * first.teeth / 2 if mesh.is_shifted else geometry.radii[0]
    assert_allclose(geometry.force_per_torque, 1 / (reference * cosines), rtol=1e-13)


@pytest.mark.parametrize(("make", "options"), PAIRS)
def test_arms_are_the_radii_across_each_axis(make, options):
    _, geometry, first, second = make(**options)
    assert_allclose(np.linalg.norm(geometry.arms, axis=1), geometry.radii, rtol=1e-14)
    assert_allclose([geometry.arms[0] @ first.axis, geometry.arms[1] @ second.axis], 0, atol=1e-15)


def test_parallel_radii_are_half_module_times_teeth_and_outer_gears_turn_against_each_other():
    _, geometry, _, _ = parallel_pair()
    assert_allclose(geometry.radii, [0.05, 0.1125], rtol=1e-14)
    assert geometry.pitch_angles_deg == (0.0, 0.0)
    assert geometry.driven_rotation == -1
    assert parallel_pair(flip=-1.0)[1].driven_rotation == 1
    assert parallel_pair(rotation=-1)[1].driven_rotation == 1


@pytest.mark.parametrize("angle_deg", [60.0, 90.0, 120.0])
def test_bevel_pitch_cones_share_one_cone_distance_and_fill_the_shaft_angle(angle_deg):
    """tan(gamma) = sin(Sigma) / (z2 / z1 + cos(Sigma)); both mean radii follow from one mean cone distance."""
    _, geometry, _, _ = bevel_pair(angle_deg=angle_deg)
    sigma = np.deg2rad(angle_deg)
    gamma = np.arctan2(np.sin(sigma), 35 / 15 + np.cos(sigma))
    assert_allclose(geometry.pitch_angles_deg, np.rad2deg([gamma, sigma - gamma]), rtol=1e-12)
    outer_cone_distance = 0.005 * 15 / 2 / np.sin(gamma)
    mean = outer_cone_distance - 0.025 / 2
    assert_allclose(geometry.radii, [mean * np.sin(gamma), mean * np.sin(sigma - gamma)], rtol=1e-12)


def test_a_line_of_centres_counts_only_by_its_direction_across_the_shafts():
    reference = parallel_pair()[1]
    for line in ([7.0, 0.0, 0.0], [1.0, 0.0, 3.0]):
        assert_allclose(parallel_pair(line=line)[1].vector, reference.vector, atol=1e-15)


def test_another_frame_turns_the_geometry_with_it():
    turn = Rotation.from_rotvec([0.4, -1.2, 0.7]).as_matrix()
    for make in (parallel_pair, bevel_pair):
        here, there = make(helix_angle_deg=30.0)[1], make(helix_angle_deg=30.0, frame=turn)[1]
        assert_allclose(there.vector.reshape(4, 3), here.vector.reshape(4, 3) @ turn.T, atol=1e-14)


def test_hand_and_rotation_together_leave_the_thrust_as_it_is():
    """A mirror image: both reversed, the axial force is the same and the tangential one turns over."""
    a = bevel_pair(helix_angle_deg=35.0)[1].normal
    b = bevel_pair(helix_angle_deg=35.0, hand="left", rotation=-1)[1].normal
    assert_allclose(b, a * [1, -1, 1], atol=1e-15)


def test_bevel_gears_need_an_apex():
    member = PairMember(teeth=15, axis=np.array([0.0, 0.0, 1.0]), apex="behind")
    other = PairMember(teeth=35, axis=np.array([1.0, 0.0, 0.0]), apex=None)
    with pytest.raises(InputError, match=r"gears\.b\.apex is missing: .* 'ahead' of it or 'behind' it"):
        mesh_geometry(a_mesh(), member, other, 1)


def test_parallel_gears_need_a_line_of_centres():
    member = PairMember(teeth=15, axis=np.array([0.0, 0.0, 1.0]), apex=None)
    with pytest.raises(InputError, match=r"shafts of 'a' and 'b' are parallel; give the mesh's line_of_centres"):
        mesh_geometry(a_mesh(), member, member, 1)


@pytest.mark.parametrize("helix_angle_deg", [0.0, 25.0])
def test_a_pair_further_apart_runs_on_the_same_base_circles(helix_angle_deg):
    """The normal stays tangent to the base cylinders: the force of a torque and the base pitch are those at the
    reference distance, and the angle to the line of centres grows as the involutes say."""
    reference = parallel_pair(helix_angle_deg=helix_angle_deg)[1]
    apart = parallel_pair(helix_angle_deg=helix_angle_deg, centre_distance=0.165)[1]
    assert_allclose(apart.radii, [0.165 * 20 / 65, 0.165 * 45 / 65], rtol=1e-12)
    assert_allclose(apart.force_per_torque, reference.force_per_torque, rtol=1e-12)
    assert_allclose(apart.base_pitch, reference.base_pitch, rtol=1e-12)
    across = [np.hypot(*geometry.normal[:2]) for geometry in (reference, apart)]
    assert_allclose(across[0], across[1], rtol=1e-12)
    cosines = [geometry.normal[1] / value for geometry, value in zip((reference, apart), across, strict=True)]
    assert_allclose(cosines[1] * 0.165, cosines[0] * 0.1625, rtol=1e-12)


def test_a_bevel_pair_has_no_centre_distance():
    with pytest.raises(InputError, match=r"centre_distance = 0\.1 is for parallel shafts"):
        bevel_pair(centre_distance=0.1)
