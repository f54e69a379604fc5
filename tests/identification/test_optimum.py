"""Randomised maximum likelihood of a linear problem, whose members are known in closed form."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.identification.optimum import Linearised, drawn_member, optimum


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
    near = Linearised.near(linear, np.zeros(3))
    rng = np.random.default_rng(1)
    z = np.array([drawn_member(linear, near, rng, 0).z for _ in range(400)])
    covariance = np.linalg.inv(linear.weighted.T @ linear.weighted + np.eye(3))
    spread = np.sqrt(np.diag(covariance))
    assert_allclose(z.mean(axis=0), linear.closed_form(linear.value, np.zeros(3)), atol=4 * spread.max() / 20)
    assert_allclose(z.std(axis=0), spread, rtol=4 / np.sqrt(800))
