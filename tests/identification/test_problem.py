"""Derivatives of all kinds of targets, in closed form, against differences of whole predictions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.identification import Targets
from sigdb.identification.problem import Problem

SENSOR = "pinion-vertical"
LEVEL = {"sensor": SENSOR, "relative_error": 0.1}
TARGETS = Targets(
    modes=[
        {"frequency_hz": 900.0, "relative_error": 0.01, "damping_ratio": 0.07, "damping_error": 0.01},
        {"frequency_hz": 2000.0, "relative_error": 0.01, "held_out": True},
    ],
    deflections=[{"sensor": SENSOR, "deflection": 1e-5, "relative_error": 0.1}],
    harmonics=[LEVEL | {"speed_rpm": speed, "amplitudes": [1.0, 0.5, 0.2]} for speed in (1300.0, 1500.0)],
    run_ups=[LEVEL | {"speeds_rpm": [1300.0, 1500.0], "levels": [1.0, 1.0]}],
)


@pytest.fixture(scope="module")
def problem(rig):
    return Problem(rig, TARGETS)


def test_slopes_are_those_of_whole_predictions(problem):
    z, direction = np.array([0.3, -0.4, 0.2]), np.array([1.0, -0.7, 0.5])
    forth, back = (problem.misses(z + step * direction, problem.value) for step in (1e-3, -1e-3))
    found, expected = problem.slopes(z), (forth - back) / 2e-3
    assert_allclose(found @ direction, expected, atol=1e-3 * np.abs(expected).max())
    assert not found[2].any()


def test_there_are_no_slopes_where_no_rig_can_be(problem):
    problem = Problem(problem.rig, Targets(modes=[{"frequency_hz": f, "relative_error": 0.1} for f in range(1, 20)]))
    assert problem.predicted(np.zeros(3)) is None
    assert not problem.slopes(np.zeros(3)).any()
