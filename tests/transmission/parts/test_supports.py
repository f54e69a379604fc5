"""Unit: bearings, couplings, shafts and bodies in every form that a rig file can give them, on small rigs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigvals, solve

from sigdb.core.errors import InputError
from sigdb.transmission import Transmission, coupled_modes, modal_system
from sigdb.transmission.parts.supports import Bearing
from sigdb.transmission.system.assembly import assemble

STEEL = {"density": 7800.0, "young_modulus": 2.1e11, "shear_modulus": 8.1e10}
BRASS = {"density": 8500.0, "young_modulus": 1.0e11, "shear_modulus": 3.7e10}
DISK = {"mass": 3.0, "polar_inertia": 0.02, "diametral_inertia": 0.012}
SPRINGS = (2e7, 3e7, 1e7)


def rotor(**changes):
    """One shaft of 0.4 m on two bearings with a disk a quarter along it, at 3000 rpm."""
    data = {
        "name": "rotor",
        "damping_ratio": 0.0,
        "operating": {"shaft": "main", "speed_rpm": 3000.0},
        "materials": {"steel": STEEL, "brass": BRASS},
        "shafts": {
            "main": {
                "axis": [0.0, 0.0, 1.0],
                "material": "steel",
                "segments": [{"length": 0.4, "outer_diameter": 0.03, "elements": 4}],
            }
        },
        "disks": {"disk": {"shaft": "main", "node": 1} | DISK},
        "bearings": {
            "left": {"shaft": "main", "node": 0, "stiffness": SPRINGS, "damping": (500.0, 300.0, 200.0)},
            "right": {"shaft": "main", "node": 4, "stiffness": SPRINGS},
        },
        "sensors": {
            f"disk-{axis}": {"gear": "probe", "direction": np.eye(3)[i].tolist(), "quantity": "displacement"}
            for i, axis in enumerate("xyz")
        },
        "gears": {"probe": {"shaft": "main", "node": 1, "teeth": 20, "mass": 1e-3, "polar_inertia": 1e-9}},
    }
    for key, value in changes.items():
        data[key] = data.get(key, {}) | value if isinstance(value, dict) else value
    return Transmission(**data)


def matrix(diagonal, **crossed):
    """Six rows of six with entries such as ``xy=...`` off the diagonal."""
    full, place = np.diag(np.array(diagonal, float)), {"x": 0, "y": 1, "z": 2, "a": 3, "b": 4}
    for entry, value in crossed.items():
        full[place[entry[0]], place[entry[1]]] = value
    return full.tolist()


def poles_of(mass, damping, stiffness):
    """All poles by the generalised eigenproblem of the first-order form."""
    n = len(mass)
    left = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
    right = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), mass]])
    return eigvals(left, right)


def same_matrices(one, other):
    for name in ("mass", "stiffness", "damping", "gyroscopic"):
        a, b = getattr(one, name), getattr(other, name)
        assert_allclose(a, b, rtol=0, atol=1e-12 * np.abs(a).max())


# --- bearings


def test_a_diagonal_bearing_matrix_is_the_three_springs_and_two_tilts():
    plain = rotor(
        bearings={
            "left": {
                "shaft": "main",
                "node": 0,
                "stiffness": SPRINGS,
                "tilt_stiffness": 4e3,
                "damping": (500.0, 300.0, 200.0),
            }
        }
    )
    full = rotor(
        bearings={
            "left": {
                "shaft": "main",
                "node": 0,
                "stiffness_matrix": matrix([*SPRINGS, 4e3, 4e3, 0]),
                "damping_matrix": matrix([500, 300, 200, 0, 0, 0]),
            }
        }
    )
    same_matrices(assemble(plain), assemble(full))
    assert_allclose(coupled_modes(full).frequency_hz, coupled_modes(plain).frequency_hz, rtol=1e-9, atol=1e-6)


CROSSED = {
    "symmetric": {"xy": 8e6, "yx": 8e6, "xb": -2e5, "bx": -2e5},
    "circulatory": {"xy": 9e6, "yx": -7e6},
    "unsymmetric": {"xy": 6e6, "yx": -1e6, "ya": 3e5, "ay": 1e5, "zx": 2e6},
}


@pytest.mark.parametrize("name", CROSSED)
def test_cross_terms_of_a_bearing_act_as_in_a_direct_solution(name):
    """K and C of the bearing added here to those of a rig without it; poles and responses by direct solution."""
    k6 = np.array(matrix([2e7, 3e7, 1e7, 5e3, 4e3, 0], **CROSSED[name]))
    c6 = np.array(matrix([500, 300, 200, 5, 5, 0], xy=250, yx=-150))
    crossed = {"shaft": "main", "node": 0, "stiffness_matrix": k6.tolist(), "damping_matrix": c6.tolist()}
    rig = rotor(bearings={"left": crossed})
    parts = assemble(rotor(bearings={"left": {"shaft": "main", "node": 0, "stiffness": (0.0, 0.0, 0.0)}}))
    stiffness, damping = parts.stiffness.copy(), parts.damping + parts.gyroscopic
    stiffness[:6, :6] += k6
    damping[:6, :6] += c6

    poles = poles_of(parts.mass, damping, stiffness)
    elastic = poles[np.abs(poles) > 10]
    found = modal_system(rig).poles
    assert len(found) == len(elastic) == len(poles) - 2
    nearest = found[np.abs(found[:, None] - elastic).argmin(axis=0)]
    assert_allclose(np.abs(nearest / elastic - 1), 0, atol=1e-7)

    # The response at the disk to the unbalance of the disk, with cross terms on either side of the diagonal.
    unbalanced = rotor(
        bearings={"left": crossed}, disks={"disk": {"shaft": "main", "node": 1, "unbalance": 1e-4} | DISK}
    )
    w = 2 * np.pi * 50
    force = np.zeros(len(parts.mass), complex)
    force[6:8] = 1e-4 * w**2 * np.array([1, -1j])
    direct = solve(stiffness + 1j * w * damping - w**2 * parts.mass, force)[6:9]
    modal = modal_system(unbalanced).transfer(np.array([w]))[0] @ [0, 0, 1, -1j]
    assert_allclose(modal, direct, rtol=1e-6, atol=1e-7 * np.abs(direct).max())


def test_a_circulatory_bearing_can_make_the_whirl_grow():
    """x'' + k x + q y = 0, y'' + k y - q x = 0 without damping: one of the two whirls grows at about q / 2 w."""
    still = {"shaft": "main", "node": 0, "motions": ["x", "y", "rz"]}
    rig = Transmission(
        name="point",
        damping_ratio=0.0,
        operating={"shaft": "main", "speed_rpm": 60.0},
        shafts={"main": {"axis": [0.0, 0.0, 1.0], "motions": still["motions"]}},
        disks={"disk": {"shaft": "main", "node": 0, "mass": 2.0, "polar_inertia": 0.01}},
        bearings={
            "both": {"shaft": "main", "node": 0, "stiffness_matrix": matrix([8e4, 8e4, 0, 0, 0, 0], xy=3e3, yx=-3e3)}
        },
    )
    expected = np.sqrt(-(8e4 + 3e3 * np.array([1j, -1j])) / 2.0)
    poles = modal_system(rig).poles
    assert_allclose(np.sort(poles.real), np.sort([*expected.real, *-expected.real]), rtol=1e-9)
    assert poles.real.max() > 3.7


@pytest.mark.parametrize(
    ("bearing", "message"),
    [
        ({"stiffness_matrix": matrix([1e7] * 5 + [0])[:5]}, r"stiffness_matrix has 5 rows; give 6 rows of 6"),
        ({"stiffness_matrix": matrix([1e7] * 6)}, r"holds the shaft against turning \(rz, rz\); set that entry to 0"),
        ({"stiffness_matrix": matrix([1e7] * 5 + [0]), "stiffness": SPRINGS}, r"stiffness and stiffness_matrix are"),
        ({"stiffness_matrix": matrix([1e7] * 5 + [0]), "tilt_stiffness": 1.0}, r"tilt_stiffness and stiffness_matrix"),
        ({"damping_matrix": matrix([1] * 6), "damping": SPRINGS, "stiffness": SPRINGS}, r"damping and damping_matrix"),
        ({}, r"stiffness is missing; give \[x, y, z\], or a stiffness_matrix"),
        ({"stiffness": (1e7, -1e7, 0.0)}, r"stiffness = .* must not be negative"),
    ],
)
def test_a_bearing_that_contradicts_itself_is_refused(bearing, message):
    with pytest.raises(InputError, match=message):
        rotor(bearings={"left": {"shaft": "main", "node": 0} | bearing})


# --- shafts


def test_segments_may_differ_in_section_and_material():
    """Mass, polar inertia and end-to-end axial and torsional flexibility, from the formulae of each segment."""
    segments = [
        {"length": 0.1, "outer_diameter": 0.04, "inner_diameter": 0.02, "elements": 2},
        {"length": 0.2, "outer_diameter": 0.03, "material": "brass"},
        {"length": 0.05, "outer_diameter": 0.05, "inner_diameter": 0.01, "elements": 3},
    ]
    rig = rotor(shafts={"main": {"axis": [0.0, 0.0, 1.0], "material": "steel", "segments": segments}}, disks={})
    parts, n = assemble(rig), 7
    with_disk = 3.0 + 1e-3
    mass = polar = axial = torsional = 0.0
    for one, material in zip(segments, (STEEL, BRASS, STEEL), strict=True):
        outer, inner = one["outer_diameter"], one.get("inner_diameter", 0.0)
        area, second = np.pi / 4 * (outer**2 - inner**2), np.pi / 32 * (outer**4 - inner**4)
        mass += material["density"] * area * one["length"]
        polar += material["density"] * second * one["length"]
        axial += one["length"] / (material["young_modulus"] * area)
        torsional += one["length"] / (material["shear_modulus"] * second)
    along = np.arange(n) * 6
    for kind, expected in ((2, mass + with_disk), (5, polar + 0.02 + 1e-9)):
        v = np.zeros(6 * n)
        v[along + kind] = 1
        assert_allclose(v @ parts.mass @ v, expected, rtol=1e-12)
    bare = assemble(rotor(shafts=rig.model_dump()["shafts"], disks={}, bearings={
        "left": {"shaft": "main", "node": 0, "stiffness": (0.0, 0.0, 0.0)},
        "right": {"shaft": "main", "node": 4, "stiffness": (0.0, 0.0, 0.0)},
    }))  # fmt: skip
    for kind, expected in ((2, axial), (5, torsional)):
        take = along + kind
        k = bare.stiffness[np.ix_(take, take)][1:, 1:]
        assert_allclose(np.linalg.inv(k)[-1, -1], expected, rtol=1e-9)


def test_dividing_segments_is_not_changing_them():
    """Two segments of two elements are one of four, and a shaft's material that of its segments."""
    halves = [{"length": 0.2, "outer_diameter": 0.03, "elements": 2, "material": "steel"}] * 2
    split = rotor(shafts={"main": {"axis": [0.0, 0.0, 1.0], "segments": halves}})
    same_matrices(assemble(split), assemble(rotor()))


def test_a_segment_without_material_is_refused():
    with pytest.raises(InputError, match=r"shafts\.main\.segments\.0\.material is missing; give it there or for the"):
        rotor(shafts={"main": {"axis": [0.0, 0.0, 1.0], "segments": [{"length": 0.4, "outer_diameter": 0.03}] * 4}})


def test_a_rigid_shaft_is_one_node_with_the_inertia_of_what_it_carries():
    """Two translations on springs, two tilts on tilt springs with gyroscopics: all in closed form."""
    rig = Transmission(
        name="rigid",
        damping_ratio=0.0,
        operating={"shaft": "main", "speed_rpm": 6000.0},
        shafts={"main": {"axis": [0.0, 0.0, 1.0]}},
        disks={"disk": {"shaft": "main", "node": 0} | DISK},
        bearings={"both": {"shaft": "main", "node": 0, "stiffness": SPRINGS, "tilt_stiffness": 6e3}},
    )
    parts = assemble(rig)
    assert_allclose(parts.mass, np.diag([3.0] * 3 + [0.012] * 2 + [0.02]))
    spin, tilt = 0.02 * 2 * np.pi * 100, 6e3
    # Id th'' - i Ip W th' + k th = 0 of the complex tilt: forward and backward precession.
    tilts = np.abs(np.roots([0.012, -spin, -tilt]))
    expected = [*np.sqrt(np.array(SPRINGS) / 3.0), *tilts]
    assert_allclose(np.sort(coupled_modes(rig).frequency_hz), np.sort(expected) / (2 * np.pi), rtol=1e-9)


def test_motions_that_are_left_out_do_not_move():
    """A shaft that only bends in one plane and turns is what is left of the full one's matrices."""
    full = rotor()
    planar = rotor(shafts={"main": full.model_dump()["shafts"]["main"] | {"motions": ["x", "ry", "rz"]}})
    parts, few = assemble(full), assemble(planar)
    kept = [6 * node + kind for node in range(5) for kind in (0, 4, 5)]
    assert few.mass.shape == (15, 15)
    for name in ("mass", "stiffness", "damping", "gyroscopic"):
        assert_allclose(getattr(few, name), getattr(parts, name)[np.ix_(kept, kept)], rtol=0, atol=1e-9)
    assert few.motions["main torsion"] == [2, 5, 8, 11, 14]
    assert few.motions["main axial"] == []
    assert sorted(i for dofs in few.motions.values() for i in dofs) == list(range(15))


def test_a_shaft_must_be_able_to_turn():
    with pytest.raises(InputError, match=r"motions = \['x', 'y'\] leaves out rz; a shaft must be able to turn"):
        rotor(shafts={"main": {"axis": [0.0, 0.0, 1.0], "motions": ["x", "y"]}})


# --- couplings


def halves(stiffness, lateral, *, axis=(0.0, 0.0, 1.0), to_node=0):
    """The rotor cut in two at its middle, the second half described along ``axis``."""
    segment = [{"length": 0.2, "outer_diameter": 0.03, "elements": 2}]
    away = 2 - to_node
    link = {"shaft": "main", "node": 2, "stiffness": stiffness, "to_shaft": "rest", "to_node": to_node}
    return rotor(
        shafts={
            "main": {"axis": [0.0, 0.0, 1.0], "material": "steel", "segments": segment},
            "rest": {"axis": list(axis), "material": "steel", "segments": segment},
        },
        bearings={
            "left": {"shaft": "main", "node": 0, "stiffness": SPRINGS, "tilt_stiffness": 1e4},
            "left-middle": {"shaft": "main", "node": 2, "stiffness": (1e6, 1e6, 0.0)},
            "right-middle": {"shaft": "rest", "node": to_node, "stiffness": (1e6, 1e6, 0.0)},
            "right": {"shaft": "rest", "node": away, "stiffness": SPRINGS, "tilt_stiffness": 1e4},
        },
        couplings={"joint": link | {"lateral_stiffness": lateral, "damping": 0.0}},
    )


def hinged():
    """One shaft of four elements whose two halves share position and torsion at the middle, but not their tilt."""
    parts = assemble(halves(1.0, (0.0, 0.0, 0.0)))
    join = np.zeros((36, 32))
    free = [i for i in range(36) if i not in (18, 19, 20, 23)]
    join[free, range(32)] = 1
    for mine, other in ((12, 18), (13, 19), (14, 20), (17, 23)):
        join[other, free.index(mine)] = 1
    torsion = np.zeros(36)
    torsion[[17, 23]] = -1, 1
    stiffness = parts.stiffness - np.outer(torsion, torsion)
    return join.T @ parts.mass @ join, join.T @ parts.gyroscopic @ join, join.T @ stiffness @ join


def test_a_very_stiff_coupling_joins_two_shafts_into_one_that_is_hinged():
    """Couplings carry torque and forces, and no bending moment."""
    mass, gyroscopic, stiffness = hinged()
    poles = poles_of(mass, gyroscopic, stiffness)
    expected = np.sort(poles.imag[poles.imag > 100])
    found = coupled_modes(halves(1e10, (1e13, 1e13, 1e13))).frequency_hz * 2 * np.pi
    assert_allclose(found[:14], expected[:14], rtol=1e-5)
    softer = coupled_modes(halves(1e3, (1e6, 1e6, 1e6))).frequency_hz * 2 * np.pi
    assert np.abs(softer[:12] / expected[:12] - 1).max() > 0.02


def test_the_sense_in_which_a_coupled_shaft_is_described_does_not_matter():
    """The second half numbered from its far end, its axis against the first's: it turns left-handed about it."""
    forward, backward = halves(2e4, (1e7, 2e7, 3e7)), halves(2e4, (1e7, 2e7, 3e7), axis=(0.0, 0.0, -1.0), to_node=2)
    assert_allclose(forward.speed("rest"), 2 * np.pi * 50, rtol=1e-12)
    assert_allclose(backward.speed("rest"), -2 * np.pi * 50, rtol=1e-12)
    assert_allclose(coupled_modes(backward).frequency_hz, coupled_modes(forward).frequency_hz, rtol=1e-7)
    parts = assemble(backward)
    assert_allclose(parts.stiffness @ parts.free_rotation, 0, atol=1e-6)


def test_a_coupling_is_a_spring_and_a_damper_in_torsion(undamped_frequencies):
    """Two rigid disks on rigid shafts: w^2 = k (1 / I1 + 1 / I2)."""
    shaft = {"axis": [1.0, 0.0, 0.0], "motions": ["rz"]}
    rig = Transmission(
        name="two-disks",
        damping_ratio=0.0,
        operating={"shaft": "one", "speed_rpm": 100.0},
        shafts={"one": shaft, "two": shaft},
        disks={
            "a": {"shaft": "one", "node": 0, "mass": 1.0, "polar_inertia": 0.02},
            "b": {"shaft": "two", "node": 0, "mass": 1.0, "polar_inertia": 0.05},
        },
        couplings={
            "joint": {"shaft": "one", "node": 0, "to_shaft": "two", "stiffness": 3e3, "damping": 0.4},
        },
    )
    inverse = 1 / 0.02 + 1 / 0.05
    assert_allclose(undamped_frequencies(rig), [np.sqrt(3e3 * inverse) / (2 * np.pi)], rtol=1e-12)
    expected = np.roots([1, 0.4 * inverse, 3e3 * inverse])
    poles = modal_system(rig).poles
    assert_allclose(poles[np.argsort(poles.imag)], expected[np.argsort(expected.imag)], rtol=1e-9)


def test_a_coupling_leads_to_a_machine_or_to_a_shaft():
    coupling = {"shaft": "main", "node": 0, "stiffness": 1e3}
    for both in ({}, {"inertia": 0.1, "to_shaft": "main"}):
        with pytest.raises(InputError, match=r"give either the inertia of an end machine, or to_shaft, one of the two"):
            rotor(couplings={"joint": coupling | both})


# --- bodies


def test_a_disk_as_a_shape_is_the_disk_of_its_numbers():
    shape = {"outer_diameter": 0.2, "inner_diameter": 0.03, "width": 0.025, "material": "brass"}
    m = 8500 * np.pi / 4 * (0.2**2 - 0.03**2) * 0.025
    squares = (0.2**2 + 0.03**2) / 4
    numbers = {
        "mass": m,
        "polar_inertia": m / 2 * squares,
        "diametral_inertia": m / 12 * (3 * squares + 0.025**2),
    }
    at = {"shaft": "main", "node": 1}
    same_matrices(assemble(rotor(disks={"disk": at | shape})), assemble(rotor(disks={"disk": at | numbers})))


@pytest.mark.parametrize(
    ("disk", "message"),
    [
        ({"mass": 1.0}, r"mass and polar_inertia belong together; give both"),
        ({"mass": 1.0, "polar_inertia": 1.0, "width": 0.1}, r"mass and width are both given; give numbers or a shape"),
        ({"outer_diameter": 0.2, "width": 0.02}, r"material is missing; give material, outer_diameter, width, or mass"),
        ({}, r"material is missing; give material, outer_diameter, width, or mass and polar_inertia"),
        ({"outer_diameter": 0.2, "width": 0.02, "material": "gold"}, r"disks\.disk\.material = 'gold' does not exist"),
    ],
)
def test_a_disk_is_a_shape_or_numbers(disk, message):
    with pytest.raises(InputError, match=message):
        rotor(disks={"disk": {"shaft": "main", "node": 1} | disk})


def test_a_gear_that_meshes_with_none_needs_numbers():
    shaped = {"shaft": "main", "node": 1, "teeth": 20, "body_length": 0.02, "material": "steel"}
    with pytest.raises(InputError, match=r"gears\.probe takes part in no mesh, so it has no pitch radius; give its"):
        rotor(gears={"probe": shaped})


def test_entries_of_matrices_have_the_unit_of_their_place():
    rows = [[0.0] * 6 for _ in range(6)]
    rows[0][0], rows[0][4], rows[4][0], rows[4][4] = "0.1 kN/um", "3 kN/rad", "2 kN m/m", "5 kN m/rad"
    damping = [row.copy() for row in rows]
    damping[0][0], damping[0][4], damping[4][0], damping[4][4] = "1 N s/mm", "3 N s/rad", "2 N m s/m", "5 N m s/rad"
    bearing = Bearing(shaft="main", node=0, stiffness_matrix=rows, damping_matrix=damping)
    assert_allclose(bearing.matrices[0][np.ix_([0, 4], [0, 4])], [[1e8, 3e3], [2e3, 5e3]], rtol=0)
    assert_allclose(bearing.matrices[1][np.ix_([0, 4], [0, 4])], [[1e3, 3.0], [2.0, 5.0]], rtol=0)
    rows[4][4] = "5 kN/m"
    with pytest.raises(InputError, match=r"stiffness_matrix\.4\.4: '5 kN/m' is a stiffness; a torsional stiffness is"):
        Bearing(shaft="main", node=0, stiffness_matrix=rows)
