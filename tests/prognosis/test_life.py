"""The remaining life against the gamma law of equal steps, and where none is given."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import gamma

from sigdb.core import InputError
from sigdb.prognosis import SeverityFilter, archard_wear, remaining_life, severity_after

LEVELS = np.arange(1.0, 13.0)


def seen(law, levels, *, elapsed=1.0, sure=60.0):
    """Posterior after looks that show exact levels of tooth 2 of 3."""
    chain = SeverityFilter(law, teeth=3, initiation=1e-3)
    for number in levels:
        look = np.full((3, len(law.levels)), -sure)
        look[1, number] = sure
        after = chain.look(look, elapsed=elapsed)
    return after


def unchecked(after):
    """The posterior without that of growth beyond the prior."""
    return replace(after, beyond=None)


def test_equal_steps_have_the_gamma_law():
    after = unchecked(seen(archard_wear(LEVELS, rates=[0.5]), [0, 1, 2, 3]))
    life = remaining_life(after, limit=9.0, level=0.8)
    low, median, high = gamma(5, scale=2.0).ppf([0.1, 0.5, 0.9])
    assert life.low == pytest.approx(low, rel=0.02)
    assert life.median == pytest.approx(median, rel=0.02)
    assert life.high == pytest.approx(high, rel=0.02)
    assert not life.reason


def test_a_limit_that_is_reached_leaves_no_time():
    life = remaining_life(seen(archard_wear(LEVELS, rates=[0.5]), [0, 1, 2, 3]), limit=3.0)
    assert (life.low, life.median, life.high) == (0.0, 0.0, 0.0)


def test_no_life_is_given_without_damage():
    law = archard_wear(LEVELS, rates=[0.5])
    after = SeverityFilter(law, teeth=3, initiation=1e-3).look(np.zeros((3, 12)), elapsed=1.0)
    life = remaining_life(after, limit=9.0)
    assert np.isnan(life.median)
    assert life.reason == "damage is not sure enough"


def test_no_life_is_given_where_the_looks_contradict_the_law():
    # A level a look, where the law has one in a hundred looks.
    life = remaining_life(seen(archard_wear(LEVELS, rates=[0.01]), range(8)), limit=12.0)
    assert life.reason == "the looks contradict the growth law or its prior, Archard wear"


def test_no_life_is_given_before_the_damage_was_seen_to_grow():
    # From 1 to 2, where 9 is a ratio of 4.5 away; from 1 to 3 it is a ratio of 3.
    law = archard_wear(LEVELS, rates=[0.5])
    assert "not yet seen to grow" in remaining_life(seen(law, [0, 1]), limit=9.0).reason
    assert not remaining_life(unchecked(seen(law, [0, 1, 2])), limit=9.0).reason


def test_no_life_is_given_where_the_looks_leave_a_faster_end_open():
    # A crack 1 / (1 - t / 1000) is 4 at 750 and 9 at 889; by constant speeds 9 comes after 1250 more.
    law = archard_wear(np.geomspace(1.0, 12.0, 24), rates=np.geomspace(1e-4, 0.05, 12))
    crack = severity_after(1.0, np.arange(0.0, 751.0, 50.0), rate=1e-3, exponent=4.0)
    looks = np.abs(np.log(law.levels / crack[:, None])).argmin(axis=1)
    after = seen(law, looks, elapsed=50.0, sure=20.0)
    assert remaining_life(unchecked(after), limit=9.0).low > 139
    assert "ends before" in remaining_life(after, limit=9.0).reason


def test_no_life_is_given_at_an_end_of_the_prior():
    # Five looks a level where the prior has half a level to two levels a look.
    looks = np.repeat(np.arange(2), 8)
    life = remaining_life(seen(archard_wear(LEVELS, rates=[0.25, 0.5, 1.0, 2.0]), looks), limit=12.0)
    assert life.reason == "the speed of growth lies at an end of the prior of Archard wear"


@pytest.mark.parametrize("limit", [1.0, 13.0])
def test_a_limit_beyond_the_levels_is_refused(limit):
    with pytest.raises(InputError, match="beyond the levels"):
        remaining_life(seen(archard_wear(LEVELS, rates=[0.5]), [0]), limit=limit)
