"""Verification: a bank between its operating points, against laws in closed form at those points."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import multivariate_normal

from sigdb.core import InputError
from sigdb.database import QUANTITIES, Template
from sigdb.measurement import index_error_covariance
from sigdb.recognition import Hypotheses, TemplateBank

TEETH, STEP, MATE = 4, 6, 10
N = TEETH * STEP
INDEX_ERROR, NOISE = 2e-6, 0.4
SEVERITY = np.array([[0.0, 0.0, 0], [0.2, 0.0, 1], [0.4, 2.0, 2]])
STREAM = np.random.default_rng(8)
MESH = np.tile(STREAM.standard_normal((2, STEP)), TEETH)
SHAPES = MESH + np.array([0.0, 0.3, 1.0])[:, None, None] * STREAM.standard_normal((2, N))
FIRST = STREAM.standard_normal((2, N))
STATIC = np.tile(STREAM.standard_normal(STEP), TEETH)
ANGLE = 2 * np.pi * np.arange(N) / N
HARMONIC = np.stack([np.cos(ANGLE), -np.sin(ANGLE)], axis=1)


def resonance(speed_rpm):
    """Real and imaginary part of the magnification of an oscillator of 1000 rpm with a tenth of critical damping."""
    ratio = speed_rpm / 1000.0
    value = 1 / (1 - ratio**2 + 0.2j * ratio)
    return np.array([value.real, value.imag])


def template(speed_rpm, torque, case, *, static=0.0, harmonic=None):
    """The signal is in proportion to the torque but for a static part; the response to index errors is without it."""
    parts = resonance(speed_rpm)
    response = np.stack([np.roll(2e4 * parts @ FIRST, j * STEP) for j in range(TEETH)], axis=1)
    orders = np.zeros(0) if harmonic is None else np.array([1.0])
    of_shaft = 0.0 if harmonic is None else HARMONIC * parts[0] * torque**harmonic
    return Template(
        case={"template": case, "tooth": min(case, 1)} | dict(zip(QUANTITIES, SEVERITY[case], strict=True)),
        signals=(torque / 10 * parts @ SHAPES[case] + static * STATIC)[None],
        specimen_response=response[None],
        harmonic_response=np.broadcast_to(of_shaft, (N, 2)).reshape(1, N, 1, 2)[:, :, : len(orders)],
        orders=orders,
        reference_variance=np.ones(1),
    )


def made_bank(points, *, cases=None, **options):
    laws = [
        Hypotheses.from_templates(
            [template(*point, case, **options) for case in (cases or {}).get(i, range(len(SEVERITY)))],
            teeth=TEETH,
            mate_teeth=MATE,
        )
        for i, point in enumerate(points)
    ]
    shares = [np.where(law.healthy, 1.0, 1 / max(1, (~law.healthy).sum())) for law in laws]
    bank = {"sensor": "casing", "index_error": INDEX_ERROR, "noise": NOISE}
    return TemplateBank.of_laws(laws, shares, points=points, **bank)


def log_density(one, turn, x):
    """The law of an average written out, in its own frame."""
    angle = one.orders * turn * 2 * np.pi / TEETH
    phases = np.stack([np.cos(angle), np.sin(angle)], axis=1).ravel()
    mean = np.roll(one.signals[0] + one.harmonic_response[0].reshape(N, -1) @ phases, turn * STEP)
    response = np.roll(one.specimen_response[0], turn * STEP, axis=0) @ np.roll(np.eye(TEETH), -turn, axis=0)
    spread = INDEX_ERROR**2 * response @ index_error_covariance(TEETH, MATE) @ response.T
    return multivariate_normal.logpdf(x, mean, NOISE**2 * np.eye(N) + spread)


def greatest_error(bank, points, **options):
    """Greatest error of the log-likelihood of rows under the template and tooth that they come from."""
    stream, errors = np.random.default_rng(9), []
    for speed_rpm, torque in points:
        for case in range(len(SEVERITY)):
            one = template(speed_rpm, torque, case, **options)
            turn = 2 if case else 0
            angle = one.orders * turn * 2 * np.pi / TEETH
            phases = np.stack([np.cos(angle), np.sin(angle)], axis=1).ravel()
            clean = one.signals[0] + one.harmonic_response[0].reshape(N, -1) @ phases
            x = np.roll(clean, turn * STEP) + NOISE * stream.standard_normal(N)
            ((local, at, coefficients),) = bank.locals(*(np.array([value]) for value in (speed_rpm, torque, TEETH)))
            assert at.tolist() == [0]
            place = np.flatnonzero((local.severity == SEVERITY[case]).all(axis=1))[0]
            given = {"noise": NOISE, "index_error": INDEX_ERROR, "coefficients": coefficients}
            found = local.laws.log_likelihood(x[None], **given)[0, place, turn]
            errors.append(abs(found - log_density(one, turn, x)))
    return max(errors)


def spread(count, stream, low=900.0, high=1100.0, torque=(8.0, 12.0)):
    """Operating points one torque each, with speeds in equal steps."""
    return list(zip(np.linspace(low, high, count).tolist(), stream.uniform(*torque, count).tolist(), strict=True))


@pytest.fixture(scope="module")
def points():
    return spread(33, np.random.default_rng(1))


@pytest.fixture(scope="module")
def between():
    stream = np.random.default_rng(2)
    return list(zip(stream.uniform(900, 1100, 12).tolist(), stream.uniform(8, 12, 12).tolist(), strict=True))


def test_between_its_points_the_laws_are_those_of_the_point(points, between):
    """The stated error e changes a log-likelihood by e times a standard normal number, and by e^2 / 2."""
    bank = made_bank(points)
    (found,) = bank.interpolations
    assert found.error <= 0.1
    assert greatest_error(bank, between) < 4 * math.hypot(found.error, 0.1)


def test_it_keeps_as_many_speeds_as_the_error_takes(points):
    (found,) = made_bank(points).interpolations
    assert 4 < found.speeds < len(points)
    (finer,) = made_bank(spread(65, np.random.default_rng(1))).interpolations
    assert abs(finer.speeds - found.speeds) <= 3
    bank = made_bank(points)
    assert len(bank.points) == found.speeds


def test_the_nearest_point_would_not_do(points, between):
    """What the interpolation is for: of the same bank without it a template is hundreds of nats away."""
    bank = made_bank(points)
    alone = TemplateBank(sensor="casing", index_error=INDEX_ERROR, points=bank.points)
    assert greatest_error(alone, between) > 100


@pytest.mark.parametrize(
    ("options", "torques"), [({"static": 0.5}, 2), ({"harmonic": 0}, 1), ({"harmonic": 1}, 1), ({"harmonic": 1}, 2)]
)
def test_parts_with_and_without_the_torque(between, options, torques):
    """A part of the signal that the torque does not change takes two torques at each speed."""
    speeds = np.linspace(900, 1100, 33).tolist()
    stream = np.random.default_rng(3)
    given = [8.0, 12.0] if torques == 2 else None
    points = [(speed, torque) for speed in speeds for torque in given or [float(stream.uniform(8, 12))]]
    bank = made_bank(points, **options)
    (found,) = bank.interpolations
    assert greatest_error(bank, between, **options) < 4 * math.hypot(found.error, 0.1)


def test_a_static_part_that_one_torque_does_not_show_is_not_interpolated():
    points = spread(33, np.random.default_rng(4))
    assert made_bank(points, static=0.5).interpolations == ()


@pytest.mark.parametrize("count", [2, 3, 5])
def test_too_few_speeds_are_answered_by_the_nearest(count):
    points = spread(count, np.random.default_rng(5))
    bank = made_bank(points)
    assert bank.interpolations == ()
    assert len(bank.points) == count
    ((local, _, coefficients),) = bank.locals(np.array([901.0]), np.array([points[0][1]]), np.array([TEETH]))
    assert local is bank.points[0].local
    assert coefficients is None


def test_the_nearest_point_has_the_least_relative_difference():
    bank = made_bank(spread(5, np.random.default_rng(5)))
    speed, torque = np.random.default_rng(6).uniform([[850], [7]], [[1150], [13]], (2, 50))
    place = np.array([(point.speed_rpm, point.torque) for point in bank.points])
    apart = [np.hypot(*(np.array(row) / place - 1).T) for row in zip(speed, torque, strict=True)]
    assert_array_equal(bank.nearest(speed, torque, np.full(50, TEETH)), np.argmin(apart, axis=1))


def test_one_speed_holds_at_every_torque():
    bank = made_bank([(950.0, 10.0)])
    assert greatest_error(bank, [(950.0, 7.0), (950.0, 10.0), (950.0, 13.0)]) < 0.01
    assert bank.reasons(np.array([960.0]), np.array([10.0]), np.array([TEETH])) == [""]


def test_it_says_how_far_it_reaches(points):
    """Beyond the last speed the error grows: within the reach it is small, and beyond there is a reason."""
    bank = made_bank(points)
    low, high = bank.interpolations[0].speed_rpm
    assert 860 < low <= 900
    assert 1100 <= high < 1140
    assert greatest_error(bank, [(low, 10.0), (high, 10.0)]) < 4 * 0.3 + 0.1
    speeds = np.array([low - 1, low, 1000.0, high, high + 1])
    reasons = bank.reasons(speeds, np.full(5, 10.0), np.full(5, TEETH))
    assert [bool(reason) for reason in reasons] == [True, False, False, False, True]
    assert reasons[0].startswith(f"speed_rpm = {low - 1:.6g} rpm is beyond the templates, which hold from")


def test_a_template_that_some_speeds_lack_answers_between_those_that_have_it():
    points = spread(33, np.random.default_rng(6))
    bank = made_bank(points, cases=dict.fromkeys(range(8), (0, 1)))
    (found,) = bank.interpolations
    assert found.error <= 0.3
    teeth, torque = np.array([TEETH]), np.array([10.0])
    counts = [len(next(iter(bank.locals(np.array([speed]), torque, teeth)))[0].share) for speed in (905.0, 1050.0)]
    assert counts == [2, 3]


def test_the_level_of_the_noise_is_that_at_the_operating_point(points):
    bank = made_bank(points)
    speed_rpm, torque = 1013.0, 9.0
    ((local, _, coefficients),) = bank.locals(*(np.array([value]) for value in (speed_rpm, torque, TEETH)))
    expected = template(speed_rpm, torque, 0).signals[0].var()
    assert_allclose(local.healthy_variance(coefficients), expected, rtol=2e-3)


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"ranges": 10**9}, "has 1000000000 ranges of speed; at most 512 exist"),
        ({"speed_rpm": (1100.0, 900.0)}, r"holds from 1100\.0 to 900\.0 rpm"),
        ({"speed_rpm": (900.0, math.nan)}, "which is no range of speeds"),
    ],
)
def test_numbers_that_no_bank_states_are_refused(points, changed, text):
    bank = made_bank(points)
    foreign = replace(bank, interpolations=(replace(bank.interpolations[0], **changed),))
    with pytest.raises(InputError, match=text):
        next(foreign.locals(np.array([1000.0]), np.array([10.0]), np.array([TEETH])))
