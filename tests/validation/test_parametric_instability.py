"""Validation: the published boundaries of parametric instability, on one oscillator.

Mathieu's characteristic values: NIST Digital Library of Mathematical Functions, chapter 28 (q = 0.5: b1 0.470654,
a1 1.466767). Damped and square-wave boundaries: Hill's determinant and Meissner's closed form, with r the frequency of
the stiffness over the natural frequency.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.dynamics import floquet_multiplier
from sigdb.transmission import ModalSystem

STEPS = 2000
PHASE = 2 * np.pi * (np.arange(STEPS) + 0.5) / STEPS


def oscillator(zeta, omega):
    damped = omega * np.sqrt(1 - zeta**2)
    inputs = np.array([[1.0, 1.0], [-1.0, -1.0]]) / (2j * damped)
    return ModalSystem(
        poles=np.array([-zeta * omega + 1j * damped, -zeta * omega - 1j * damped]),
        inputs=inputs,
        outputs=np.ones((1, 2), dtype=complex),
        direct=np.zeros((1, 2)),
        meshes=("main",),
        sensors=(),
        mesh_stiffness=np.array([omega**2]),
    )


def multiplier(variation, r, zeta=0.0):
    """Of x'' + 2 zeta x' + (1 + variation) x = 0, over one period of the variation, 2 pi / r."""
    return floquet_multiplier(oscillator(zeta, 1.0), 1 + variation, 2 * np.pi / r)


@pytest.mark.parametrize(("a", "unstable"), [(0.468, False), (0.473, True), (1.464, True), (1.4695, False)])
def test_mathieu_is_unstable_between_b1_and_a1(a, unstable):
    """x'' + (a - 2 q cos 2t) x = 0 at q = 0.5."""
    found = floquet_multiplier(oscillator(0.0, np.sqrt(a)), a - np.cos(PHASE), np.pi)
    assert (found > 1 + 1e-3) is unstable
    assert found > 1 - 1e-6


def meissner_trace(r, depth=0.3):
    """Trace of the monodromy matrix of a square wave of +/- depth: stable where its size is below 2."""
    a, b = np.sqrt(1 + depth), np.sqrt(1 - depth)
    half = np.pi / r
    return 2 * np.cos(a * half) * np.cos(b * half) - (a / b + b / a) * np.sin(a * half) * np.sin(b * half)


def test_the_square_waves_boundaries_are_the_published_ones():
    for r in (1.805814, 2.186257):
        assert abs(abs(meissner_trace(r)) - 2) < 2e-6


@pytest.mark.parametrize(
    ("r", "unstable"), [(1.8035, False), (1.808, True), (2.0, True), (2.184, True), (2.1885, False)]
)
def test_square_wave_is_unstable_between_the_published_boundaries(r, unstable):
    found = multiplier(0.3 * np.sign(np.sin(PHASE)), r)
    assert (found > 1 + 1e-3) is unstable
    half_trace = max(abs(meissner_trace(r)) / 2, 1)
    assert_allclose(found, half_trace + np.sqrt(half_trace**2 - 1), rtol=2e-3 if unstable else 1e-9)


@pytest.mark.parametrize(
    ("r", "unstable"), [(1.881, False), (1.885, True), (2.0, True), (2.105, True), (2.1085, False)]
)
def test_damped_tongue_at_twice_the_natural_frequency(r, unstable):
    """1 + 0.3 cos(r t) with 5 % damping: unstable for 1.883144 < r < 2.106392."""
    assert (multiplier(0.3 * np.cos(PHASE), r, zeta=0.05) > 1) is unstable


def test_damped_tongue_begins_at_four_times_the_damping_ratio():
    """Threshold 0.2001 at 5 % damping."""
    speeds = np.linspace(1.97, 2.02, 26)
    assert max(multiplier(0.1990 * np.cos(PHASE), r, zeta=0.05) for r in speeds) < 1
    assert max(multiplier(0.2012 * np.cos(PHASE), r, zeta=0.05) for r in speeds) > 1
