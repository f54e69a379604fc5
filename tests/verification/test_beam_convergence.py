"""Verification: natural frequencies of beam models converge to exact ones at the element's order."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from sigdb.transmission.parts.shafts import Material
from sigdb.transmission.system.beam import beam_element

STEEL = Material(density=7810.0, young_modulus=2.11e11, shear_modulus=8.12e10)
LENGTH, DIAMETER = 1.0, 0.1


def uniform_shaft(elements, diameter):
    element = beam_element(LENGTH / elements, diameter, 0.0, STEEL)
    mass, stiffness = np.zeros((2, 6 * elements + 6, 6 * elements + 6))
    for i in range(elements):
        span = slice(6 * i, 6 * i + 12)
        mass[span, span] += element.mass
        stiffness[span, span] += element.stiffness
    return mass, stiffness


def frequencies_hz(elements, kinds, held=(), diameter=DIAMETER):
    """Of the motion in some kinds of freedom, with some degrees of freedom held."""
    mass, stiffness = uniform_shaft(elements, diameter)
    free = [6 * node + kind for node in range(elements + 1) for kind in kinds if 6 * node + kind not in held]
    take = np.ix_(free, free)
    return np.sqrt(eigh(stiffness[take], mass[take], eigvals_only=True).clip(min=0)) / (2 * np.pi)


def simply_supported_hz(elements, count, diameter=DIAMETER):
    return frequencies_hz(elements, (0, 4), (0, 6 * elements), diameter)[:count]


def exact_simply_supported_hz(order, diameter=DIAMETER):
    """Roots of the Timoshenko beam's characteristic equation with v = sin(n pi z / L)."""
    e, g, rho = 2.11e11, 8.12e10, 7810.0
    nu = e / (2 * g) - 1
    kappa = 6 * (1 + nu) / (7 + 6 * nu)
    area, inertia = np.pi / 4 * diameter**2, np.pi / 64 * diameter**4
    a = order * np.pi / LENGTH
    quadratic = [
        rho**2 * inertia / (kappa * g),
        -(rho * area + rho * inertia * a**2 * (1 + e / (kappa * g))),
        e * inertia * a**4,
    ]
    return np.sqrt(np.roots(quadratic).min()) / (2 * np.pi)


def test_the_exact_frequencies_are_the_published_ones():
    """A beam of L 1 m, d 0.1 m, kappa 0.8863."""
    published = [201.6949, 780.1034, 1669.4688, 2793.0866, 4083.3581]
    assert_allclose([exact_simply_supported_hz(n) for n in range(1, 6)], published, rtol=2e-5)


def test_bending_frequencies_of_a_stout_beam_converge_to_timoshenkos_at_second_order():
    """Shear strain is constant within an element, so its share of the error falls with the square of the length."""
    exact = np.array([exact_simply_supported_hz(n) for n in (1, 2, 3)])
    errors = np.array([simply_supported_hz(elements, 3) / exact - 1 for elements in (8, 16, 32)])
    assert (errors > 0).all(), "a consistent model is stiffer than the beam"
    assert_allclose(np.log2(errors[:-1] / errors[1:]), 2, atol=0.15)
    assert_allclose(errors[-1], 0, atol=6e-4)


def test_bending_frequencies_of_a_slender_beam_converge_at_fourth_order():
    """Without shear the element is the cubic one of Euler and Bernoulli."""
    exact = np.array([exact_simply_supported_hz(n, diameter=0.004) for n in (1, 2, 3)])
    errors = np.array([simply_supported_hz(elements, 3, diameter=0.004) / exact - 1 for elements in (4, 8, 16)])
    assert_allclose(np.log2(errors[:-1] / errors[1:]), 4, atol=0.3)
    assert_allclose(errors[-1], 0, atol=1e-4)


def test_bending_frequencies_of_two_meshes_extrapolate_to_the_exact_ones():
    """Richardson, with the second order shown above."""
    exact = [exact_simply_supported_hz(n) for n in range(1, 6)]
    coarse, fine = simply_supported_hz(24, 5), simply_supported_hz(48, 5)
    assert_allclose((4 * fine - coarse) / 3, exact, rtol=2e-5)


def test_both_planes_bend_alike():
    held = (1, 6 * 12 + 1)
    assert_allclose(frequencies_hz(12, (1, 3), held)[:5], simply_supported_hz(12, 5), rtol=1e-9)


@pytest.mark.parametrize(("kind", "modulus"), [(2, 2.11e11), (5, 8.12e10)], ids=["axial", "torsion"])
def test_axial_and_torsional_frequencies_converge_at_second_order(kind, modulus):
    """A bar held at one end: f_n = (2 n - 1) c / (4 L), c = sqrt(E / rho) or sqrt(G / rho)."""
    exact = np.array([1, 3]) * np.sqrt(modulus / 7810) / (4 * LENGTH)
    errors = np.array([frequencies_hz(elements, (kind,), held=(kind,))[:2] / exact - 1 for elements in (8, 16, 32)])
    assert_allclose(np.log2(errors[:-1] / errors[1:]), 2, atol=0.06)
    assert_allclose(errors[-1], 0, atol=1.2e-3)
