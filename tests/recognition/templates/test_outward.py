"""Verification: damage beyond the templates, against the score test of normal laws written out."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import kstest

from sigdb.recognition.templates.outward import beyond, outward_changes
from sigdb.recognition.templates.turned_laws import TurnedLaws

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


@pytest.fixture(scope="module")
def laws():
    modes = np.linalg.qr(STREAM.standard_normal((len(LEVELS), N, 3)))[0]
    gains = np.tile([3.0, 2.0, 1.0], (len(LEVELS), 1))
    phases = np.ones((len(LEVELS), 1, 1))
    carriers = SIGNALS[:, None, None]
    return TurnedLaws(teeth=TEETH, healthy=HEALTHY, modes=modes, gains=gains, carriers=carriers, phases=phases)


def rows(laws, template, loss, count, noise, seed=6):
    stream = np.random.default_rng(seed)
    spread = (stream.standard_normal((count, 3)) * laws.gains[template]) @ laws.modes[template].T
    x = signal(loss, LEVELS[template, 1]) + spread + noise * stream.standard_normal((count, N))
    return np.roll(x, 2 * STEP, axis=1), np.tile([template, 2], (count, 1)), np.full(count, noise)


def test_it_is_the_score_test_written_out(laws):
    x, best, noise = rows(laws, 3, 0.6, 5, 0.3)
    changes = outward_changes(LEVELS, HEALTHY, SIGNALS)
    found = beyond(laws, changes, x, best, noise=noise, index_error=1.0, coefficients=None)
    U = laws.modes[3] * laws.gains[3]
    inverse = np.linalg.inv(0.3**2 * np.eye(N) + U @ U.T)
    residual = np.roll(x, -2 * STEP, axis=1) - SIGNALS[3]
    d = changes[3, 0]
    assert_allclose(found, residual @ inverse @ d / np.sqrt(d @ inverse @ d), rtol=1e-9)


def test_at_the_end_itself_it_is_a_standard_normal_number(laws):
    x, best, noise = rows(laws, 3, 0.4, 4000, 0.3)
    changes = outward_changes(LEVELS, HEALTHY, SIGNALS)
    found = beyond(laws, changes, x, best, noise=noise, index_error=1.0, coefficients=None)
    assert kstest(found, "norm").pvalue > 1e-3
    more = beyond(laws, changes, rows(laws, 3, 0.6, 200, 0.3)[0], best[:200], noise=noise[:200], **NOMINAL)
    assert np.median(more) > 3


NOMINAL = {"index_error": 1.0, "coefficients": None}


def test_inside_the_grid_nothing_is_beyond(laws):
    x, best, noise = rows(laws, 2, 0.2, 20, 0.3)
    changes = outward_changes(LEVELS, HEALTHY, SIGNALS)
    assert_array_equal(beyond(laws, changes, x, best, noise=noise, **NOMINAL), 0)
