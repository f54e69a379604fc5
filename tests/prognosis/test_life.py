"""The remaining life against the gamma law of equal steps, beyond the prior, and where none is given."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import expon, gamma

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
    """The posterior by the law alone."""
    return replace(after, beyond=None, log_evidence_of_change=-np.inf)


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


def test_a_limit_between_two_levels_lies_between_their_lives():
    # One step of rate 0.5 from 4 to 5: the limit 4.5 is log(4.5 / 4) / log(5 / 4) of it.
    after = unchecked(seen(archard_wear(LEVELS, rates=[0.5]), [0, 1, 2, 3]))
    share = np.log(4.5 / 4) / np.log(5 / 4)
    at_start, step = 1 - share, expon(scale=2.0)
    life = remaining_life(after, limit=4.5, level=0.2)
    assert life.median == pytest.approx(step.ppf((0.5 - at_start) / share), rel=0.02)
    assert life.high == pytest.approx(step.ppf((0.6 - at_start) / share), rel=0.02)


def test_growth_beyond_the_prior_is_in_the_interval_until_the_looks_decide():
    # A crack 1 / (1 - t / 1000) is 4 at 750 and 9 at 889; by constant speeds 9 comes after 1250 more.
    law = archard_wear(np.geomspace(1.0, 12.0, 24), rates=np.geomspace(1e-4, 0.05, 12))
    crack = severity_after(1.0, np.arange(0.0, 751.0, 50.0), rate=1e-3, exponent=4.0)
    looks = np.abs(np.log(law.levels / crack[:, None])).argmin(axis=1)
    after = seen(law, looks, elapsed=50.0, sure=20.0)
    alone, both = remaining_life(unchecked(after), limit=9.0), remaining_life(after, limit=9.0)
    beyond = remaining_life(after.beyond, limit=9.0)
    assert both.low < 139 < alone.low
    assert (both.low, both.high) == (min(alone.low, beyond.low), max(alone.high, beyond.high))
    assert both.median == alone.median


def test_a_law_that_the_looks_contradict_takes_no_part():
    # A level a look, where the law has one in a hundred looks.
    after = seen(archard_wear(LEVELS, rates=[0.01]), range(8))
    life, beyond = remaining_life(after, limit=12.0), remaining_life(after.beyond, limit=12.0)
    assert (life.low, life.median, life.high) == (beyond.low, beyond.median, beyond.high)
    assert life.high < remaining_life(unchecked(after), limit=12.0).high


def test_no_life_is_given_where_the_growth_changes_on_the_way():
    # A level a look, nothing in two hundred, then a level a look again.
    law = archard_wear(LEVELS, rates=[0.5, 1.0])
    after = seen(law, [0, 1, 2, 3, *[3] * 200, 4, 5, 6, 7, 8])
    assert "the growth changes on the way" in remaining_life(after, limit=12.0).reason
    assert not remaining_life(seen(law, range(9)), limit=12.0).reason


@pytest.mark.parametrize("limit", [1.0, 13.0])
def test_a_limit_beyond_the_levels_is_refused(limit):
    with pytest.raises(InputError, match="beyond the levels"):
        remaining_life(seen(archard_wear(LEVELS, rates=[0.5]), [0]), limit=limit)
