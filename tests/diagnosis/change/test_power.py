"""The damage that would have been seen at one more rig, from the tries of an ensemble."""

import numpy as np
import pytest

from sigdb.diagnosis.change.power import for_one_more

VALUES = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8])
RIG = np.repeat(np.arange(8), 20)


def test_rigs_that_differ_lognormally_give_the_bound_of_students_law():
    """One of eight rigs needs 0.6, all others 0.1: mean and deviation of the logarithm in closed form."""
    law = np.exp(np.log(0.1) + np.log(6) / 8 + 1.8946 * np.sqrt(9 / 8) * np.log(6) * np.sqrt(7) / 8)
    assert 0.4 < law < 0.5
    assert for_one_more(np.where(RIG == 0, 0.6, 0.1), VALUES, RIG) == 0.5


@pytest.mark.parametrize(("neediest", "stated"), [(0.5, 0.5), (0.6, np.inf)])
def test_the_greatest_of_all_rigs_is_stated_only_where_a_rig_left_out_would_be_seen(neediest, stated):
    """With 0.6 all tries of one rig of eight are beyond all others; the law of logarithms needs 1.2 or more in both."""
    needed = np.tile([0.1, 0.5], 80)
    assert for_one_more(np.where(RIG == 0, neediest, needed), VALUES, RIG) == stated


def test_a_skew_towards_small_values_does_not_raise_the_value_beyond_what_all_tries_needed():
    needed = np.tile(np.repeat([0.1, 0.3, 0.4, 0.5], 5), 8)
    assert for_one_more(needed, VALUES, RIG) == 0.5


def test_values_beyond_the_range_are_not_stated():
    assert for_one_more(np.where(RIG % 2 == 0, np.inf, 0.5), VALUES, RIG) == np.inf


def test_pulses_of_one_kind_are_bounded_by_the_normal_law_of_logarithms():
    needed = np.repeat([0.2, 0.4], 80)
    assert np.exp(np.log(0.2 * 0.4) / 2 + 1.6449 * np.log(2) / 2) == pytest.approx(0.5, abs=1e-2)
    assert for_one_more(needed, VALUES, None) == 0.4
