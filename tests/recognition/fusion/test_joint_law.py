"""The joint law of several averages: against the normal density written out, one average alone, and its own draws."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import multivariate_normal

from sigdb.core.errors import InputError, NotApplicableError
from sigdb.database import Template
from sigdb.measurement import index_error_covariance
from sigdb.recognition import Hypotheses
from sigdb.recognition.fusion.joint_law import AverageLaw, JointLaw

TEETH, MATE = 4, 10
ORDERS = np.array([1.0, 3.0])


def templates(stream, step, point):
    n = TEETH * step
    return [
        Template(
            case={"template": 7 * point + i, "tooth": min(i, 1), "stiffness_loss": 0.1 * i, "speed_rpm": 100.0 * point},
            signals=stream.standard_normal((1, n)),
            specimen_response=1e5 * stream.standard_normal((1, n, TEETH)),
            harmonic_response=0.3 * stream.standard_normal((1, n, 2, 2)),
            orders=ORDERS,
            reference_variance=np.ones(1),
        )
        for i in range(3)
    ]


@pytest.fixture(scope="module")
def stored():
    stream = np.random.default_rng(3)
    return [templates(stream, step, point) for point, step in enumerate((6, 5, 6))]


@pytest.fixture(scope="module")
def joint(stored):
    return JointLaw.of([AverageLaw.of(hypotheses(some)) for some in stored])


def hypotheses(some):
    return Hypotheses.from_templates(some, teeth=TEETH, mate_teeth=MATE)


def law(stored, k, turn, noise, sizes):
    """Mean and covariance of all averages together, written out in the machine's own frame."""
    means, responses = [], []
    angle = ORDERS * turn * 2 * np.pi / TEETH
    phases = np.stack([np.cos(angle), np.sin(angle)], axis=1).ravel()
    turned = np.roll(np.eye(TEETH), -turn, axis=0)
    for some, size in zip(stored, sizes, strict=True):
        n = some[k].signals.shape[1]
        shift = turn * n // TEETH
        means.append(np.roll(some[k].signals[0] + some[k].harmonic_response[0].reshape(n, -1) @ phases, shift))
        responses.append(size * np.roll(some[k].specimen_response[0], shift, axis=0) @ turned)
    response = np.vstack(responses)
    white = np.repeat(np.asarray(noise) ** 2, [len(mean) for mean in means])
    return np.concatenate(means), np.diag(white) + response @ index_error_covariance(TEETH, MATE) @ response.T


def test_it_is_the_normal_density_of_all_averages_together(stored, joint):
    noise, sizes = np.array([0.5, 0.7, 0.2]), np.array([2e-6, 1e-6, 3e-6])
    x = [np.random.default_rng(4 + i).standard_normal((2, some[0].signals.shape[1])) for i, some in enumerate(stored)]
    found = joint.log_likelihood(x, noise=noise, index_error=sizes)
    for machine in range(2):
        whole = np.concatenate([each[machine] for each in x])
        for k in range(3):
            for t in range(TEETH):
                expected = multivariate_normal.logpdf(whole, *law(stored, k, t if k else 0, noise, sizes))
                assert_allclose(found[machine, k, t], expected, rtol=1e-10)


def test_distances_of_templates_are_those_of_all_averages_together(stored, joint):
    noise, sizes = np.array([0.5, 0.7, 0.2]), np.array([2e-6, 1e-6, 3e-6])
    found = joint.distances(np.array([0, 2]), noise=noise, index_error=sizes)
    means = [np.concatenate([some[k].signals[0] for some in stored]) for k in (0, 2)]
    inverses = [np.linalg.inv(law(stored, k, 0, noise, sizes)[1]) for k in (0, 2)]
    away = means[0] - means[1]
    assert_allclose(found, [away @ (inverses[0] + inverses[1]) @ away / 2])


def test_one_average_alone_has_its_own_law(stored):
    one = hypotheses(stored[1])
    x = np.random.default_rng(5).standard_normal((3, one.signal.shape[1]))
    sizes = {"noise": 0.3, "index_error": 2e-6}
    found = JointLaw.of([AverageLaw.of(one)]).log_likelihood([x], **sizes)
    assert_allclose(found, one.log_likelihood(x, **sizes), rtol=1e-10)


def test_without_index_errors_the_log_likelihoods_add_up_and_with_them_they_do_not(stored, joint):
    laws = [hypotheses(some) for some in stored]
    x = [np.random.default_rng(6).standard_normal((2, one.signal.shape[1])) for one in laws]

    def both(size):
        alone = sum(one.log_likelihood(y, noise=0.3, index_error=size) for one, y in zip(laws, x, strict=True))
        return joint.log_likelihood(x, noise=0.3, index_error=size), alone

    assert_allclose(*both(0.0), rtol=1e-10)
    together, alone = both(3e-6)
    assert np.abs(together - alone).min() > 0.1


def test_drawn_averages_have_the_mean_and_the_covariance_of_the_law(stored, joint):
    noise, sizes = np.array([0.5, 0.7, 0.2]), np.array([2e-6, 1e-6, 3e-6])
    many = 20_000
    drawn = joint.draw(np.random.default_rng(8), np.full(many, 2), np.full(many, 3), noise=noise, index_error=sizes)
    mean, covariance = law(stored, 2, 2, noise, sizes)
    found = np.hstack(drawn)
    deviation = np.sqrt(np.diag(covariance))
    assert np.abs((found.mean(axis=0) - mean) / deviation).max() < 5 / np.sqrt(many)
    scaled = np.cov(found.T) / np.outer(deviation, deviation)
    assert np.abs(scaled - covariance / np.outer(deviation, deviation)).max() < 6 / np.sqrt(many)


def test_templates_are_those_that_all_averages_have_in_one_order(stored):
    first, other = (AverageLaw.of(hypotheses(some)) for some in stored[:2])
    joint = JointLaw.of([first, other.only([2, 0])])
    assert joint.severity[:, 0].tolist() == [0.0, 0.2]
    assert_allclose(joint.laws[1].signal, other.signal[[0, 2]])
    with pytest.raises(NotApplicableError, match="no healthy or no damaged template in common"):
        JointLaw.of([first, other.only([0])])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda x: x[:2], "2 averages are given for 3 laws"),
        (lambda x: [x[0], x[1][:, 1:], x[2]], r"average 1 has the shape \(1, 19\); give 1 rows of 20 samples"),
    ],
)
def test_averages_that_do_not_fit_are_refused(joint, change, message):
    x = [np.zeros((1, one.signal.shape[1])) for one in joint.laws]
    with pytest.raises(InputError, match=message):
        joint.log_likelihood(change(x), noise=1.0, index_error=0.0)
    with pytest.raises(InputError, match="noise = 0 must be above 0"):
        joint.log_likelihood(x, noise=0.0, index_error=0.0)
