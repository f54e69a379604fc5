"""Verification: changes beyond the templates, against the derivatives of a parabola."""

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.recognition.templates.outward import outward_changes

TEETH, STEP = 4, 6
N = TEETH * STEP
LEVELS = np.array([[0, 0, 0], [0.1, 0, 1], [0.2, 0, 1], [0.4, 0, 1], [0.2, -1, 1], [0.2, 2, 1], [0.4, 2, 2]], float)
HEALTHY = LEVELS[:, 2] == 0
STREAM = np.random.default_rng(5)
BASE, LOSS, BENT, SHIFT = STREAM.standard_normal((4, N))


def signal(loss, shift):
    return BASE + 10 * loss * LOSS + 8 * loss**2 * BENT + 0.4 * shift * SHIFT


SIGNALS = np.array([signal(loss, shift) for loss, shift, _ in LEVELS])


def test_changes_are_the_derivatives_at_the_ends_of_lines():
    """A parabola is met exactly. The line of one tooth at shift 0 begins at the healthy gear."""
    changes = outward_changes(LEVELS, HEALTHY, SIGNALS)
    expected = np.zeros_like(changes)
    expected[3, 0] = 10 * LOSS + 2 * 8 * 0.4 * BENT
    expected[5, 1] = 0.4 * SHIFT
    expected[4, 1] = -0.4 * SHIFT
    assert_allclose(changes, expected, atol=1e-12)


def test_a_line_of_two_has_the_slope_between_them_and_a_pattern_none():
    severity = np.array([[0, 0, 0], [0.3, 0, 1], [np.nan, np.nan, np.nan]])
    changes = outward_changes(severity, severity[:, 2] == 0, np.array([BASE, BASE + LOSS, BASE]))
    assert_allclose(changes[1, 0], LOSS / 0.3)
    assert_array_equal(changes[[0, 2]], 0)
