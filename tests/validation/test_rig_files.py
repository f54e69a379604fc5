"""Validation: natural frequencies of the published rigs, loaded from their files."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission import Transmission, coupled_modes, load_transmission

TURBO_GENERATOR = [
    11.641, 12.284, 17.268, 18.458, 23.956, 37.681, 49.889, 50.861, 56.248, 57.752, 59.188, 63.113, 74.203
]  # fmt: skip


def test_the_turbo_generator_file():
    """Damped, Hz, published to 0.001 Hz. The book leaves out axial motion, which its file must hold somehow."""
    modes = coupled_modes(load_transmission("friswell-turbogenerator"))
    axial = [next(iter(moves)).endswith("axial") for moves in modes.moves]
    lateral = modes.frequency_hz[~np.array(axial)]
    assert_allclose(lateral[:13], TURBO_GENERATOR, rtol=1e-4)


def test_the_turbo_generators_one_low_axial_mode_is_that_of_the_generator_shaft():
    """Generator, exciter, wheel and the shaft's own bars on two axial springs of 1e8 N/m, put together here."""
    modes = coupled_modes(load_transmission("friswell-turbogenerator"))
    low = next(i for i, moves in enumerate(modes.moves) if next(iter(moves)).endswith("axial"))
    assert next(iter(modes.moves[low])) == "generator-shaft axial"
    assert modes.moves[low]["generator-shaft axial"] > 0.999
    mass = np.diag([0.0, 525.7, 116.04, 0.0, 726.4])
    stiffness = np.diag([1e8, 0.0, 0.0, 1e8, 0.0])
    segments = zip([0.1, 4.24, 1.16, 0.3], [0.3, 0.3, 0.22, 0.22], strict=True)
    for i, (length, diameter) in enumerate(segments):
        area, span = np.pi / 4 * diameter**2, slice(i, i + 2)
        mass[span, span] += 7800 * area * length / 6 * np.array([[2, 1], [1, 2]])
        stiffness[span, span] += 2.07e11 * area / length * np.array([[1, -1], [-1, 1]])
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real
    assert_allclose(modes.frequency_hz[low], np.sqrt(squares.min()) / (2 * np.pi), rtol=1e-6)


@pytest.mark.parametrize(
    ("rpm", "published"),
    [
        (0.0, [86.66, 86.66, 274.31, 274.31, 650.41, 716.78]),
        (4000.0, [85.39, 87.80, 251.78, 294.71, 600.18, 650.41]),
    ],
)
def test_the_file_of_friswells_example_591(rpm, published):
    """Published to 0.01 rad/s."""
    rig = load_transmission("friswell-5.9.1").replace({"operating.speed_rpm": rpm})
    assert_allclose(2 * np.pi * coupled_modes(rig).frequency_hz[:6], published, atol=0.011)


@pytest.mark.parametrize(
    ("name", "published"),
    [
        ("chaari-8dof", [536.54, 1006.58, 1057.51, 1186.27, 1203.74, 2099.87, 5687.22]),
        ("luo-10dof", [38.69, 102.43, 447.28, 451.61, 828.56, 873.88, 1275.82, 1361.21, 5103.19]),
    ],
)
def test_the_files_of_lumped_rigs(name, published, undamped_frequencies):
    """Undamped, Hz, to the last published digit; the free rotation, 0 Hz in the tables, is left out."""
    found = undamped_frequencies(load_transmission(name))
    assert_allclose(found, published, atol=0.0051)


def geared_torsion(stiffness):
    """Im -k_m- gear 1 in mesh with gear 2, ratio 1; each gear has a branch k_R - Ir. Nothing but torsion moves."""
    gear = {"node": 0, "teeth": 20, "mass": 1.0, "polar_inertia": 25e-6}
    branch = {"node": 0, "stiffness": 5e3, "inertia": 700e-6}
    shaft = {"axis": [0.0, 0.0, 1.0], "motions": ["rz"]}
    return Transmission(
        name="geared-torsion",
        damping_ratio=0.0,
        operating={"drive": "motor", "load": "second", "speed_rpm": 1500.0, "torque": 1.0},
        shafts={"one": shaft, "two": shaft},
        gears={"gear-1": gear | {"shaft": "one"}, "gear-2": gear | {"shaft": "two"}},
        couplings={
            "motor": {"shaft": "one", "node": 0, "stiffness": 1e4, "inertia": 400e-6},
            "first": branch | {"shaft": "one"},
            "second": branch | {"shaft": "two"},
        },
        meshes={
            "main": {
                "driving": "gear-1",
                "driven": "gear-2",
                "module": 0.005,
                "face_width": 0.02,
                "pressure_angle_deg": 20.0,
                "line_of_centres": [1.0, 0.0, 0.0],
                "stiffness": stiffness,
                "profile": {"contact_ratio": 1.5, "flank": 0.3},
            }
        },
    )


def test_geared_torsion(undamped_frequencies):
    """Published: 0 (left out), 425.36, 634.07, 3247.19 Hz, with gears that are rigidly geared.

    That is the limit of a stiff mesh: the error falls as 1 / k, and the fourth frequency goes to infinity.
    """
    published = np.array([425.36, 634.07, 3247.19])
    found = {k: undamped_frequencies(geared_torsion(k)) for k in (1e10, 1e11, 1e13)}
    assert_allclose(found[1e13][:3], published, atol=0.0051)
    softer, stiffer = (np.abs(found[k][1:3] - found[1e13][1:3]) for k in (1e10, 1e11))
    assert_allclose(softer / stiffer, 10, rtol=0.02)
    # Both gears against each other, Ig / 2 on k rb^2 with rb = 50 mm cos 20 deg.
    rb = 0.05 * np.cos(np.deg2rad(20))
    assert_allclose(found[1e13][3], np.sqrt(1e13 * rb**2 * 2 / 25e-6) / (2 * np.pi), rtol=1e-6)
