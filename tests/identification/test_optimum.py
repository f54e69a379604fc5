"""Randomised maximum likelihood of a linear problem, whose members are known in closed form."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.identification.optimum import Linearised, drawn_member, optima, optimum


@dataclass(frozen=True)
class Linear:
    """``g(z) = G z``, measured with errors; numbers with 0 in ``is_fitted`` are held out."""

    G: np.ndarray
    value: np.ndarray
    error: np.ndarray
    is_fitted: np.ndarray

    @property
    def paths(self):
        return range(self.G.shape[1])

    @cached_property
    def weighted(self):
        return self.is_fitted[:, None] * self.G / self.error[:, None]

    def misses(self, z, value):
        return self.is_fitted * (self.G @ z - value) / self.error

    def slopes(self, z):
        return self.weighted

    def closed_form(self, value, prior):
        A = self.weighted
        return np.linalg.solve(A.T @ A + np.eye(A.shape[1]), A.T @ (value / self.error) + prior)


@pytest.fixture
def linear():
    rng = np.random.default_rng(3)
    return Linear(rng.standard_normal((5, 3)), rng.standard_normal(5), np.full(5, 0.3), np.array([1, 1, 1, 1, 0.0]))


def test_the_most_probable_point_is_that_of_the_normal_equations(linear):
    end = optimum(linear, linear.value, np.zeros(3), np.ones(3))
    assert_allclose(end.z, linear.closed_form(linear.value, np.zeros(3)), atol=1e-6)
    missed = linear.misses(end.z, linear.value)
    assert end.misfit == pytest.approx((missed**2).sum() / 4)
    assert end.cost == pytest.approx((missed**2).sum() + (end.z**2).sum())


def test_members_of_a_linear_problem_are_draws_of_its_posterior(linear):
    """Their mean and covariance are those of the normal posterior, within four standard errors of 400 members."""
    near = [Linearised.near(linear, np.zeros(3))]
    rng = np.random.default_rng(1)
    z = np.array([drawn_member(linear, near, rng, 0).z for _ in range(400)])
    covariance = np.linalg.inv(linear.weighted.T @ linear.weighted + np.eye(3))
    spread = np.sqrt(np.diag(covariance))
    assert_allclose(z.mean(axis=0), linear.closed_form(linear.value, np.zeros(3)), atol=4 * spread.max() / 20)
    assert_allclose(z.std(axis=0), spread, rtol=4 / np.sqrt(800))


@dataclass(frozen=True)
class TwoOptima(Linear):
    """``g(z) = (z_0^2, z_0)``, measured as 4 +- 0.1 and 2 +- 2: optima are near 2, and near -2 at a cost 4 higher."""

    paths = range(1)
    start = np.array([-2.0])

    def misses(self, z, value):
        return (np.array([z[0] ** 2, z[0]]) - value) / self.error

    def slopes(self, z):
        return np.array([[2 * z[0]], [1.0]]) / self.error[:, None]


@pytest.fixture
def two():
    return TwoOptima(np.zeros((2, 1)), np.array([4.0, 2.0]), np.array([0.1, 2.0]), np.ones(2))


def test_the_best_optimum_comes_first_wherever_the_rig_is(two):
    """From the rig as it is, a search ends near -2."""
    assert optimum(two, two.value, np.zeros(1), two.start).z == pytest.approx(-2.0, abs=0.01)
    assert optima(two, np.random.default_rng(0))[0].z == pytest.approx(2.0, abs=0.01)


def test_a_member_is_the_best_optimum_of_its_own_draw(two):
    near = [Linearised.near(two, np.array([z])) for z in (-2.0, 2.0)]
    for seed in range(10):
        rng = np.random.default_rng(seed)
        prior, shift = rng.standard_normal(1), rng.standard_normal(2)
        ends = [optimum(two, two.value + shift * two.error, prior, np.array([z])) for z in (-2.0, 2.0)]
        member = drawn_member(two, near, np.random.default_rng(seed), 0)
        assert member.cost == pytest.approx(min(end.cost for end in ends), abs=1e-2)
