"""Unit: the beam element against its published closed form, and identities of a rigid or static beam.

Closed form of bending: M. I. Friswell, J. E. T. Penny, S. D. Garvey, A. W. Lees, Dynamics of Rotating Machines,
Cambridge, 2010, section 5.4 (also J. S. Przemieniecki, Theory of Matrix Structural Analysis, 1968).
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.transmission.parts.shafts import Material
from sigdb.transmission.system.beam import beam_element, shear_coefficient

STEEL = Material(density=7810.0, young_modulus=2.11e11, shear_modulus=8.12e10)
SECTIONS = [
    pytest.param(0.08, 0.0, id="solid"),
    pytest.param(0.08, 0.05, id="hollow"),
    pytest.param(0.3, 0.0, id="stubby"),
]
LENGTH = 0.25
# A plane's deflection, and its slope dv/dz: theta_y in x-z, -theta_x in y-z.
XZ = np.eye(12)[[0, 4, 6, 10]]
YZ = np.eye(12)[[1, 3, 7, 9]] * np.array([1, -1, 1, -1])[:, None]


def section(outer, inner):
    area = np.pi / 4 * (outer**2 - inner**2)
    inertia = np.pi / 64 * (outer**4 - inner**4)
    nu = 2.11 / (2 * 0.812) - 1
    m = inner / outer
    kappa = 6 * (1 + nu) * (1 + m**2) ** 2 / ((7 + 6 * nu) * (1 + m**2) ** 2 + (20 + 12 * nu) * m**2)
    phi = 12 * 2.11e11 * inertia / (kappa * 8.12e10 * area * LENGTH**2)
    return area, inertia, phi


def symmetric(rows):
    upper = np.zeros((4, 4))
    upper[np.triu_indices(4)] = rows
    return upper + np.triu(upper, 1).T


def published_stiffness(outer, inner):
    _, inertia, p = section(outer, inner)
    L = LENGTH
    rows = [12, 6 * L, -12, 6 * L, (4 + p) * L**2, -6 * L, (2 - p) * L**2, 12, -6 * L, (4 + p) * L**2]
    return 2.11e11 * inertia / ((1 + p) * L**3) * symmetric(rows)


def published_translational_mass(outer, inner):
    area, _, p = section(outer, inner)
    L = LENGTH
    m1, m2, m3 = 312 + 588 * p + 280 * p**2, (44 + 77 * p + 35 * p**2) * L, 108 + 252 * p + 140 * p**2
    m4, m5 = -(26 + 63 * p + 35 * p**2) * L, (8 + 14 * p + 7 * p**2) * L**2
    m6 = -(6 + 14 * p + 7 * p**2) * L**2
    return 7810 * area * L / (840 * (1 + p) ** 2) * symmetric([m1, m2, m3, m4, m5, -m4, m6, m1, -m2, m5])


def published_rotary_mass(outer, inner):
    _, inertia, p = section(outer, inner)
    L = LENGTH
    m7, m8, m9, m10 = 36, (3 - 15 * p) * L, (4 + 5 * p + 10 * p**2) * L**2, (-1 - 5 * p + 5 * p**2) * L**2
    return 7810 * inertia / (30 * (1 + p) ** 2 * L) * symmetric([m7, m8, -m7, m8, m9, -m8, m10, m7, -m8, m9])


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
@pytest.mark.parametrize("plane", [XZ, YZ], ids=["xz", "yz"])
def test_bending_stiffness_is_the_published_one(outer, inner, plane):
    expected = published_stiffness(outer, inner)
    element = beam_element(LENGTH, outer, inner, STEEL)
    assert_allclose(plane @ element.stiffness @ plane.T, expected, rtol=1e-11, atol=1e-11 * abs(expected).max())


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
@pytest.mark.parametrize("plane", [XZ, YZ], ids=["xz", "yz"])
def test_bending_mass_is_the_published_consistent_one_with_rotary_inertia(outer, inner, plane):
    expected = published_translational_mass(outer, inner) + published_rotary_mass(outer, inner)
    element = beam_element(LENGTH, outer, inner, STEEL)
    assert_allclose(plane @ element.mass @ plane.T, expected, rtol=1e-11, atol=1e-12 * abs(expected).max())


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
def test_gyroscopic_matrix_is_twice_the_rotary_mass_between_the_planes(outer, inner):
    """Ip = 2 Id for a round section, and Id theta_x'' + Ip Omega theta_y' = Mx: with slope -theta_x, the sign turns."""
    element = beam_element(LENGTH, outer, inner, STEEL)
    expected = 2 * published_rotary_mass(outer, inner)
    tolerance = {"rtol": 1e-11, "atol": 1e-12 * abs(expected).max()}
    assert_allclose(YZ @ element.gyroscopic @ XZ.T, -expected, **tolerance)
    assert_allclose(XZ @ element.gyroscopic @ YZ.T, expected, **tolerance)
    assert_allclose(XZ @ element.gyroscopic @ XZ.T, 0, atol=1e-15)


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
def test_axial_and_torsional_matrices_are_those_of_a_bar(outer, inner):
    area, inertia, _ = section(outer, inner)
    element = beam_element(LENGTH, outer, inner, STEEL)
    stiff, consistent = np.array([[1, -1], [-1, 1]]) / LENGTH, LENGTH / 6 * np.array([[2, 1], [1, 2]])
    for dofs, k, m in (([2, 8], 2.11e11 * area, 7810 * area), ([5, 11], 8.12e10 * 2 * inertia, 7810 * 2 * inertia)):
        assert_allclose(element.stiffness[np.ix_(dofs, dofs)], k * stiff, rtol=1e-12)
        assert_allclose(element.mass[np.ix_(dofs, dofs)], m * consistent, rtol=1e-12)


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
def test_motions_do_not_mix_and_matrices_are_symmetric_or_skew(outer, inner):
    element = beam_element(LENGTH, outer, inner, STEEL)
    groups = [[0, 4, 6, 10], [1, 3, 7, 9], [2, 8], [5, 11]]
    for matrix in (element.mass, element.stiffness):
        rest = matrix.copy()
        for group in groups:
            rest[np.ix_(group, group)] = 0
        assert not rest.any()
        assert_allclose(matrix, matrix.T, rtol=0, atol=1e-12 * abs(matrix).max())
    assert_allclose(element.gyroscopic, -element.gyroscopic.T, rtol=0, atol=1e-15)


def rigid_motions():
    """Six motions of a stiff element about its first node: columns."""
    motions = np.zeros((12, 6))
    for i in range(6):
        motions[[i, 6 + i], i] = 1
    motions[6, 4] = LENGTH  # turning about y moves the far end along x
    motions[7, 3] = -LENGTH  # turning about x moves it against y
    return motions


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
def test_rigid_motion_takes_no_force_and_has_the_cylinders_inertia(outer, inner):
    """M of the six motions is that of a hollow cylinder about its end: m L^2/3 + m (D^2 + d^2)/16, m (D^2 + d^2)/8."""
    element, rigid = beam_element(LENGTH, outer, inner, STEEL), rigid_motions()
    assert_allclose(element.stiffness @ rigid, 0, atol=1e-10 * abs(element.stiffness).max())
    m = 7810 * np.pi / 4 * (outer**2 - inner**2) * LENGTH
    diametral = m * LENGTH**2 / 3 + m * (outer**2 + inner**2) / 16
    polar = m * (outer**2 + inner**2) / 8
    expected = np.diag([m, m, m, diametral, diametral, polar])
    expected[0, 4] = expected[4, 0] = m * LENGTH / 2
    expected[1, 3] = expected[3, 1] = -m * LENGTH / 2
    assert_allclose(rigid.T @ element.mass @ rigid, expected, rtol=1e-12, atol=1e-13 * m)
    gyroscopic = np.zeros((6, 6))
    gyroscopic[3, 4], gyroscopic[4, 3] = polar, -polar
    assert_allclose(rigid.T @ element.gyroscopic @ rigid, gyroscopic, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize(("outer", "inner"), SECTIONS)
@pytest.mark.parametrize("elements", [1, 5])
def test_a_cantilevers_tip_deflects_by_bending_and_shear(outer, inner, elements):
    """F L^3 / (3 E I) + F L / (kappa G A) and slope F L^2 / (2 E I), exact for any number of elements."""
    _, inertia, phi = section(outer, inner)
    total = elements * LENGTH
    n = 6 * (elements + 1)
    stiffness = np.zeros((n, n))
    for i in range(elements):
        span = slice(6 * i, 6 * i + 12)
        stiffness[span, span] += beam_element(LENGTH, outer, inner, STEEL).stiffness
    force = np.zeros(n)
    force[-6] = 1000.0
    tip = np.linalg.solve(stiffness[6:, 6:], force[6:])[-6:]
    rigidity = 2.11e11 * inertia
    shear_rigidity = 12 * rigidity / (phi * LENGTH**2)
    assert_allclose(tip[0], 1000 * (total**3 / (3 * rigidity) + total / shear_rigidity), rtol=1e-9)
    assert_allclose(tip[4], 1000 * total**2 / (2 * rigidity), rtol=1e-9)
    assert_allclose(tip[[1, 2, 3, 5]], 0, atol=1e-15)


def test_shear_coefficient_of_a_solid_section_and_of_a_thin_tube():
    """Cowper 1966: 6 (1 + nu) / (7 + 6 nu), and 2 (1 + nu) / (4 + 3 nu) for a thin-walled tube."""
    for nu in (0.0, 0.3):
        assert_allclose(shear_coefficient(nu, 0.0), 6 * (1 + nu) / (7 + 6 * nu), rtol=1e-14)
        assert_allclose(shear_coefficient(nu, 1.0), 2 * (1 + nu) / (4 + 3 * nu), rtol=1e-14)
