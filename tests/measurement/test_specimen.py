"""Unit: index errors of a pair of gears as an average over whole tooth cycles sees them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb.core.streams import specimen_stream
from sigdb.measurement import index_error_covariance, index_errors, tooth_cycle

TEETH = st.integers(5, 60)


@given(TEETH, TEETH)
def test_a_tooth_cycle_ends_when_every_tooth_meets_its_first_mate_again(teeth, mate_teeth):
    cycle = tooth_cycle(teeth, mate_teeth)
    assert cycle * teeth == math.lcm(teeth, mate_teeth)


@given(TEETH, TEETH, st.integers(0, 2**32))
@settings(max_examples=40, deadline=None)
def test_it_is_the_mean_over_the_pairs_that_meet_pass_by_pass(teeth, mate_teeth, seed):
    """Walk a whole tooth cycle pass by pass: the pair's error is own plus mate's; average each own tooth's."""
    stream = np.random.default_rng(seed)
    own, mate = stream.standard_normal(teeth), stream.standard_normal(mate_teeth)
    own, mate = own - own.sum() / teeth, mate - mate.sum() / mate_teeth
    met = [[] for _ in range(teeth)]
    for meeting in range(math.lcm(teeth, mate_teeth)):
        met[meeting % teeth].append(own[meeting % teeth] + mate[meeting % mate_teeth])
    expected = [sum(errors) / len(errors) for errors in met]
    found = index_errors(np.random.default_rng(seed), teeth, mate_teeth)
    assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert_allclose(found.sum(), 0, atol=1e-11)


@pytest.mark.parametrize(
    ("teeth", "mate_teeth", "met"),
    [(12, 36, 3), (36, 12, 1), (13, 36, 36), (12, 18, 3), (17, 17, 1)],
)
def test_variance_and_covariance_of_the_errors(teeth, mate_teeth, met):
    """Own 1 - 1/teeth; the mate's mean over `met` teeth, less its whole mean, 1/met - 1/mate_teeth.

    The sum over the teeth vanishes, so two teeth covary by -variance / (teeth - 1) where all pairs are alike. The bound
    is five standard errors of 3000 specimens.
    """
    specimens = 3000
    errors = np.array([index_errors(specimen_stream(5, i), teeth, mate_teeth) for i in range(specimens)])
    variance = (1 - 1 / teeth) + (1 / met - 1 / mate_teeth)
    assert_allclose((errors**2).mean(), variance, rtol=5 * math.sqrt(2 / (specimens * (teeth - 1))))
    assert_allclose(errors.mean(axis=0), 0, atol=5 * math.sqrt(variance / specimens))
    assert_allclose((errors[:, 0] * errors[:, 1:].sum(axis=1)).mean(), -variance, rtol=5 * math.sqrt(2 / specimens))


def test_with_a_hunting_tooth_ratio_the_mate_contributes_nothing():
    """13 and 36 have no common factor: each tooth meets all of the mate's, whose mean is removed."""
    own = specimen_stream(3, 8).standard_normal(13)
    assert_allclose(index_errors(specimen_stream(3, 8), 13, 36), own - own.mean(), rtol=0, atol=1e-14)


def test_specimens_differ_and_repeat():
    one, again, other, reseeded = (
        index_errors(specimen_stream(*key), 12, 36) for key in ((1, 0), (1, 0), (1, 1), (2, 0))
    )
    assert np.array_equal(one, again)
    assert not np.isclose(one, other).any()
    assert not np.isclose(one, reseeded).any()


class UnitStream:
    """Gives the k-th unit vector, cut into the pieces that are asked for."""

    def __init__(self, k, length):
        self._left = np.eye(length)[k]

    def standard_normal(self, size):
        piece, self._left = self._left[:size], self._left[size:]
        return piece


@pytest.mark.parametrize("runout", [0.0, 1.5])
@pytest.mark.parametrize(("teeth", "mate_teeth"), [(12, 36), (36, 12), (13, 36), (12, 18), (12, 24), (17, 17), (2, 3)])
def test_covariance_is_that_of_the_linear_map_that_draws_the_errors(teeth, mate_teeth, runout):
    """A mate of as many teeth, or twice as many, keeps its slow orders; one of 18 or 36 teeth leaves none."""
    length = teeth + mate_teeth + 8
    columns = [index_errors(UnitStream(k, length), teeth, mate_teeth, runout=runout) for k in range(length)]
    linear = np.array(columns).T
    found = index_error_covariance(teeth, mate_teeth, runout=runout)
    assert_allclose(found, linear @ linear.T, rtol=0, atol=1e-14)


def test_slow_orders_leave_the_white_part_as_it_is():
    white, both = (index_errors(specimen_stream(1, 0), 12, 36, runout=runout) for runout in (0.0, 2.0))
    slow = np.abs(np.fft.rfft(both - white))
    assert_allclose(slow[[0, 3, 4, 5, 6]], 0, atol=1e-13)
    assert (slow[[1, 2]] > 0.1).all()


def test_covariance_by_hand():
    """Two teeth: own +-1/2. With three on the mate each meets all of them; with four, the mean of two: +-1/4 more."""
    assert_allclose(index_error_covariance(2, 3), [[0.5, -0.5], [-0.5, 0.5]], rtol=0, atol=1e-15)
    assert_allclose(index_error_covariance(2, 4), [[0.75, -0.75], [-0.75, 0.75]], rtol=0, atol=1e-15)
    assert_allclose(index_error_covariance(3, 3), 2 * np.eye(3) - 2 / 3, rtol=0, atol=1e-15)


@given(TEETH, TEETH)
@settings(max_examples=25, deadline=None)
def test_covariance_is_the_same_after_a_turn(teeth, mate_teeth):
    covariance = index_error_covariance(teeth, mate_teeth)
    assert_allclose(np.roll(covariance, (1, 1), axis=(0, 1)), covariance, rtol=0, atol=1e-15)
    assert_allclose(covariance.sum(axis=0), 0, atol=1e-13)
