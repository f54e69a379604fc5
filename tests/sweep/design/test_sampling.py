"""Verification: samples have the strata, the balance and the ends that their methods promise."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.sweep.design.sampling import grid_sample, scale_to_range, scale_to_whole, unit_sample
from sigdb.sweep.plan.layout import consecutive, distinct

METHODS = ("random", "latin-hypercube", "sobol")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("points", [1, 2, 7, 64])
def test_points_lie_in_the_unit_cube_and_differ(method, points):
    u = unit_sample(method, points, 3, np.random.default_rng(0))
    assert u.shape == (points, 3)
    assert (u >= 0).all()
    assert (u < 1).all()
    assert len(np.unique(u, axis=0)) == points


@pytest.mark.parametrize("points", [1, 5, 64, 1000])
def test_a_latin_hypercube_has_one_point_in_each_stratum_of_each_axis(points):
    """McKay, Beckman and Conover (1979), section 2.3."""
    u = unit_sample("latin-hypercube", points, 4, np.random.default_rng(1))
    for axis in np.floor(u * points).astype(int).T:
        assert sorted(axis) == list(range(points))


def test_sobol_points_are_balanced():
    """A scrambled (0, m, 2)-net in base 2 has one point in each elementary box of volume 2^-m, of every shape."""
    m = 6
    u = unit_sample("sobol", 2**m, 2, np.random.default_rng(2))
    for k in range(m + 1):
        boxes = {(int(x * 2**k), int(y * 2 ** (m - k))) for x, y in u}
        assert len(boxes) == 2**m


def test_sobol_of_any_size_begins_a_longer_one():
    long = unit_sample("sobol", 64, 3, np.random.default_rng(3))
    assert_array_equal(unit_sample("sobol", 37, 3, np.random.default_rng(3)), long[:37])


def test_stratified_means_are_nearer_than_random_ones():
    """Variance of the mean of n points of u: 1/(12 n) at random, 1/(12 n^3) in strata."""
    n, streams = 64, [np.random.default_rng(seed) for seed in range(200)]
    spread = {method: np.std([unit_sample(method, n, 1, rng).mean() for rng in streams]) for method in METHODS}
    assert_allclose(spread["random"], (12 * n) ** -0.5, rtol=0.25)
    assert_allclose(spread["latin-hypercube"], (12 * n**3) ** -0.5, rtol=0.25)


@pytest.mark.parametrize("method", METHODS)
def test_a_sample_follows_from_seed_and_grid_and_not_from_the_order_of_axes(method):
    one = grid_sample(method, 16, ("b", "a"), seed=1, grid=0)
    same = grid_sample(method, 16, ("a", "b"), seed=1, grid=0)
    for axis in "ab":
        assert_array_equal(one[axis], same[axis])
        for other in ({"seed": 2, "grid": 0}, {"seed": 1, "grid": 1}):
            assert not np.isin(one[axis], grid_sample(method, 16, ("a", "b"), **other)[axis]).all()


@given(st.integers(-50, 50), st.integers(0, 40))
@settings(max_examples=50, deadline=None)
def test_whole_numbers_reach_both_ends_equally_often(low, width):
    n = width + 1
    strata = (np.arange(10 * n) + 0.5) / (10 * n)
    found = scale_to_whole(strata, low, low + width)
    values, counts = np.unique(found, return_counts=True)
    assert values.tolist() == list(range(low, low + n))
    assert set(counts) == {10}
    ends = scale_to_whole(np.array([0.0, np.nextafter(1.0, 0.0)]), low, low + width)
    assert ends.tolist() == [low, low + width]


def test_numbers_of_a_range_are_spread_evenly():
    assert_allclose(scale_to_range(np.array([0.0, 0.25, 0.5]), -2.0, 6.0), [-2.0, 0.0, 2.0])


@given(st.lists(st.tuples(st.integers(0, 3), st.sampled_from([0.0, 0.5, -1.0])), min_size=1, max_size=30))
@settings(max_examples=50, deadline=None)
def test_distinct_rows_are_numbered_as_a_dictionary_would(rows):
    known = {}
    expected = [known.setdefault(row, len(known)) for row in rows]
    codes, first = distinct(*zip(*rows, strict=True))
    assert codes.tolist() == expected
    assert first.tolist() == [expected.index(i) for i in range(len(known))]


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 4)), max_size=10))
@settings(max_examples=50, deadline=None)
def test_consecutive_ranges(ranges):
    start, count = [one[0] for one in ranges], [one[1] for one in ranges]
    expected = itertools.chain.from_iterable(range(a, a + n) for a, n in ranges)
    assert consecutive(start, count).tolist() == list(expected)
