"""Unit: the first-order hold is the exact step of a mode under a force that is linear within it."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from sigdb.dynamics.stability import first_order_hold

H = 0.1
SERIES_ENDS = 1e-2
"""Size of pole times step at which the series gives way to the closed form."""


def augmented(pole, h):
    """E, g0, g1 from the exponential of ``(z, f, f')' = ((pole, 1, 0), (0, 0, 1), 0) (z, f, f')``, a Taylor series."""
    matrix = np.array([[pole, 1, 0], [0, 0, 1], [0, 0, 0]], complex)
    E, held, ramp = expm(h * matrix)[0]
    return E, held - ramp / h, ramp / h


@pytest.mark.parametrize("angle", np.deg2rad([90.0, 93.0, 135.0, 180.0]))
@pytest.mark.parametrize(
    "size", [0.0, 1e-9, 1e-4, 0.999 * SERIES_ENDS, 1.001 * SERIES_ENDS, 0.1, 1.0, 3.0, 20.0], ids="{:g}".format
)
def test_it_is_the_exponential_of_the_augmented_system(size, angle):
    """The first term that the series leaves out is x^5 / 720 of the whole; real poles and a pole at zero too."""
    pole = size / H * np.exp(1j * angle)
    found = first_order_hold(np.array([pole]), H)
    for one, expected in zip(found, augmented(pole, H), strict=True):
        assert_allclose(one[0], expected, rtol=3e-13, atol=1e-15)


def test_series_and_closed_form_meet():
    """Across the switch nothing jumps by more than the step in pole times h explains."""
    x = SERIES_ENDS * np.array([1 - 1e-12, 1 + 1e-12])
    for direction in (1j, -1.0):
        _, g0, g1 = first_order_hold(direction * x / H, H)
        assert_allclose(g0[0], g0[1], rtol=5e-13)
        assert_allclose(g1[0], g1[1], rtol=5e-13)


def test_many_steps_follow_a_piecewise_linear_force_exactly():
    """z' = p z + f through a triangle of force, in 3 and in 300 steps."""
    poles = np.array([-2.0 + 31j, -0.5, 0.0])
    ends = []
    for finer in (1, 100):
        f = np.interp(np.arange(3 * finer + 1) / finer, [0, 1, 2, 3], [0.0, 1.0, -2.0, 0.5])
        E, g0, g1 = first_order_hold(poles, H / finer)
        z = np.ones(3, complex)
        for before, after in pairwise(f):
            z = E * z + g0 * before + g1 * after
        ends.append(z)
    assert_allclose(ends[0], ends[1], rtol=1e-12)
    # The integrator: 1 and the area of the force.
    assert_allclose(ends[0][2], 1 + H * (0.5 - 0.5 - 0.75), rtol=1e-12)
