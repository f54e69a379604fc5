"""Verification: tests of residuals, against score tests of normal laws whose covariances are written out."""

from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import sqrtm
from scipy.stats import kstest

from sigdb.recognition.laws.turned_laws import TurnedLaws, UntiedLaws
from sigdb.recognition.noise.residual_tests import ResidualTests

TEETH, STEP, TEMPLATES = 8, 4, 5
N = TEETH * STEP
SIZE = 2e-6
STREAM = np.random.default_rng(5)
SEVERITY = np.array([[0, 0, 0], [0.1, 0, 1], [0.2, 0, 1], [0.4, 0, 1], [0.2, 0, 2]])
BEST = np.array([[3, 2], [1, 7], [3, 0], [0, 0], [2, 5]])
NOISE = np.array([0.5, 0.3, 0.8, 0.4, 0.6])
COEFFICIENTS = STREAM.uniform(0.5, 1.5, (len(BEST), 2, 2))
SINGLE = 1e-5


@pytest.fixture(scope="module")
def laws():
    return TurnedLaws(
        teeth=TEETH,
        healthy=SEVERITY[:, 2] == 0,
        modes=np.linalg.qr(STREAM.standard_normal((TEMPLATES, N, 3)))[0],
        gains=STREAM.uniform(1e5, 1e6, (TEMPLATES, 3)),
        carriers=STREAM.standard_normal((TEMPLATES, 2, 2, N)),
        phases=np.concatenate([np.ones((TEMPLATES, 1, TEETH)), STREAM.standard_normal((TEMPLATES, 1, TEETH))], axis=1),
    )


@pytest.fixture(scope="module")
def tests(laws):
    outward = np.zeros((TEMPLATES, 2, N))
    outward[3] = STREAM.standard_normal((2, N))
    change = STREAM.standard_normal((TEMPLATES, N)) * (SEVERITY[:, 2] > 0)[:, None]
    return ResidualTests(laws=laws, severity=SEVERITY, outward=outward, change=change, between=False)


@pytest.fixture(scope="module")
def averages():
    return STREAM.standard_normal((len(BEST), N))


def results(tests, x):
    return tests.results(x, BEST, noise=NOISE, index_error=SIZE, coefficients=COEFFICIENTS)


def written_out(laws, x, row):
    """Residual of a row, turned back, and the covariance of its law."""
    template, turn = BEST[row]
    mean = np.einsum("ab,b,abn->n", COEFFICIENTS[row], laws.phases[template, :, turn], laws.carriers[template])
    U = laws.modes[template] * laws.gains[template] * SIZE
    return np.roll(x[row], -turn * STEP) - mean, NOISE[row] ** 2 * np.eye(N) + U @ U.T


def score(change, residual, covariance):
    weighted = np.linalg.solve(covariance, change)
    return weighted @ residual / np.sqrt(weighted @ change)


def greatest_elsewhere(tests, residual, covariance):
    changes = tests.change[~tests.laws.healthy]
    return max(score(np.roll(c, far * STEP), residual, covariance) for far in (3, 4, 5) for c in changes)


def test_what_is_left_is_white_under_the_covariance_written_out(laws, tests, averages):
    white, _, _ = results(tests, averages)
    for row in range(len(BEST)):
        residual, covariance = written_out(laws, averages, row)
        assert_allclose(white[row], sqrtm(np.linalg.inv(covariance)).real @ residual, rtol=SINGLE, atol=SINGLE)


def test_scores_are_the_score_tests_written_out(laws, tests, averages):
    _, more, others = results(tests, averages)
    for row, (template, _) in enumerate(BEST):
        residual, covariance = written_out(laws, averages, row)
        beyond = [score(c, residual, covariance) for c in tests.outward[template] if c.any()]
        assert_allclose(more[row], max(beyond, default=-np.inf), rtol=1e-9)
        expected = greatest_elsewhere(tests, residual, covariance) if template else -np.inf
        assert_allclose(others[row], expected, rtol=1e-9)


def test_between_severities_what_another_one_explains_does_not_count(laws, tests, averages):
    """What is left is the residual of a weighted least-squares fit of the differences of severities."""
    white, more, others = results(replace(tests, between=True), averages)
    for row, (template, _) in enumerate(BEST):
        residual, covariance = written_out(laws, averages, row)
        alike = (SEVERITY[:, 2] == SEVERITY[template, 2]) | (SEVERITY[:, 2] == 0)
        D = (tests.change[alike & (np.arange(TEMPLATES) != template)] - tests.change[template]).T
        if template:
            inverse = np.linalg.inv(covariance)
            residual = residual - D @ np.linalg.solve(D.T @ inverse @ D, D.T @ inverse @ residual)
            assert_allclose(others[row], greatest_elsewhere(tests, residual, covariance), rtol=1e-7)
        assert_allclose(white[row], sqrtm(np.linalg.inv(covariance)).real @ residual, rtol=SINGLE, atol=SINGLE)
    assert_array_equal(more, results(tests, averages)[1])


def test_at_the_template_itself_more_damage_is_a_standard_normal_number(laws, tests):
    stream = np.random.default_rng(6)
    spread = (stream.standard_normal((4000, 3)) * laws.gains[3] * SIZE) @ laws.modes[3].T
    mean = np.einsum("b,abn->n", laws.phases[3, :, 2], laws.carriers[3])
    x = np.roll(mean + spread + 0.3 * stream.standard_normal((4000, N)), 2 * STEP, axis=1)
    one = replace(tests, outward=tests.outward[:, :1])
    white, more, _ = one.results(x, np.tile([3, 2], (4000, 1)), noise=np.full(4000, 0.3), index_error=SIZE)
    assert kstest(more, "norm").pvalue > 1e-3
    assert kstest(white.ravel(), "norm").pvalue > 1e-3


def test_damage_at_another_tooth_stands_out(tests, averages):
    change = np.roll(tests.change[2], (BEST[0, 1] + 4) * STEP)
    assert results(tests, averages + 10 * change)[2][0] > results(tests, averages)[2][0] + 3


def test_templates_that_are_not_turned_have_no_other_tooth(laws, tests, averages):
    parts = {each.name: getattr(laws, each.name) for each in fields(laws)}
    untied = UntiedLaws(**{**parts, "teeth": 1}, tooth=np.arange(TEMPLATES), of_teeth=TEETH)
    white, _, others = results(replace(tests, laws=untied), averages)
    assert replace(tests, laws=untied).other_teeth == 0
    assert np.isneginf(others).all()
    assert np.isfinite(white).all()
