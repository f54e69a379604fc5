"""Growth of a tooth over looks: found sooner than by single looks, seldom without damage, and a life."""

import numpy as np
import pytest
from scipy.stats import t

from sigdb.monitoring.alarms import alarm_limit, growth_limit
from sigdb.monitoring.tooth_growth import LEVELS, log_ratios, tooth_growth

TEETH, HEALTHY, SPREAD = 12, 20, 0.3


def tooth_maps(stream, amplitude):
    """Energies of looks: log-normal noise, and an amplitude at tooth 5 over that of the noise."""
    energy = np.exp(SPREAD * stream.standard_normal((HEALTHY + len(amplitude), TEETH)))
    energy[HEALTHY:, 4] *= 1 + np.asarray(amplitude) ** 2
    return energy


def grown(maps, **options):
    healthy = np.arange(len(maps)) < HEALTHY
    return tooth_growth(maps, healthy, None, doubted=np.zeros(len(maps), bool), **options)


def test_slow_growth_is_found_sooner_than_by_single_looks():
    # A single look alarms where the greatest tooth exceeds the limit of its healthy looks, with the same rate.
    amplitude = np.linspace(0.0, 1.5, 120)
    rates = {"false_alarms_a_year": 1.0, "looks_a_year": 365.0}
    first = {"filter": [], "single": []}
    for seed in range(8):
        maps = tooth_maps(np.random.default_rng(seed), amplitude)
        growth = grown(maps)
        strongest = np.log(maps / np.median(maps, axis=1, keepdims=True)).max(axis=1)
        z = (strongest - strongest[:HEALTHY].mean()) / strongest[:HEALTHY].std(ddof=1)
        for name, alarms in (
            ("filter", growth.statistic[HEALTHY:] > growth_limit(**rates)),
            ("single", z[HEALTHY:] > alarm_limit(**rates, healthy=HEALTHY)),
        ):
            first[name].append(amplitude[alarms.argmax()] if alarms.any() else amplitude[-1])
        assert growth.tooth == 5
        assert growth.tooth_probability > 0.99
    assert np.median(first["filter"]) < 0.8 * np.median(first["single"])


def test_without_damage_alarms_are_as_seldom_as_allowed():
    # An alarm above 200 comes in 200 looks or more seldom: some 7 in 25 sequences of 60, with three deviations of them.
    alarms = 0
    for seed in range(25):
        alarms += bool((grown(tooth_maps(np.random.default_rng(100 + seed), np.zeros(60))).statistic > 200).any())
    assert alarms <= 25 * 60 / 200 + 3 * np.sqrt(25 * 60 / 200)


def test_after_an_alarm_the_statistic_begins_anew():
    """A look that says nothing has a ratio of 1, and adds 1 to the statistic; the posterior goes on."""
    maps = tooth_maps(np.random.default_rng(2), [*np.full(2, 2.0), *np.zeros(6)])
    healthy, doubted = np.arange(len(maps)) < HEALTHY, np.arange(len(maps)) >= HEALTHY + 2
    growth, without = (tooth_growth(maps, healthy, None, doubted=doubted, alarm=alarm) for alarm in (200.0, np.inf))
    assert growth.statistic[HEALTHY + 1] > 200
    np.testing.assert_allclose(np.diff(growth.statistic[HEALTHY + 2 :]), 1, rtol=1e-3)
    assert without.statistic[-1] > growth.statistic[-1]
    assert (growth.probability, growth.tooth) == (without.probability, without.tooth)
    assert growth.stands_out == (growth.probability > 0.5)
    assert not without.stands_out


def test_the_ratio_is_that_of_students_law():
    maps = tooth_maps(np.random.default_rng(1), [2.0])
    healthy = np.arange(len(maps)) < HEALTHY
    y = np.log(maps)
    y = y - np.array([[np.median(np.delete(row, tooth)) for tooth in range(TEETH)] for row in y])
    scale = np.sqrt(y[healthy].var(axis=0, ddof=1).mean() * (1 + 1 / HEALTHY))
    law = t(HEALTHY - 1, loc=y[healthy][:, 4].mean(), scale=scale)
    exact = law.logpdf(y[-1, 4] - np.log1p(LEVELS**2)) - law.logpdf(y[-1, 4])
    np.testing.assert_allclose(log_ratios(maps, maps[healthy])[-1, 4], exact, rtol=1e-9)


def test_a_life_is_given_where_the_growth_was_seen():
    # From 0.8 by 3 % a look: 30 dB, an amplitude of 31.6, is reached 125 looks after the beginning.
    amplitude = 0.8 * 1.03 ** np.arange(110)
    growth = grown(tooth_maps(np.random.default_rng(3), amplitude), limit_db=30.0)
    assert not growth.life.reason
    assert growth.life.low <= 15 <= growth.life.high
    assert growth.per == "look"
    assert growth.low_db <= 20 * np.log10(amplitude[-1]) + 1.5
    assert growth.high_db >= 20 * np.log10(amplitude[-1]) - 1.5


def test_a_growth_that_stands_out_notes_its_assumed_prior():
    maps = tooth_maps(np.random.default_rng(3), np.full(5, 3.0))
    (note,) = grown(maps, alarm=200.0).notes
    assert note.code == "growth-of-amplitude"
    assert "assumed" in note.text
    assert "in 1 to 1000 looks" in note.text  # rates of 10 to 0.01 a look, to an amplitude of 10
    assert grown(maps).notes == ()


def test_no_life_is_given_without_damage():
    growth = grown(tooth_maps(np.random.default_rng(3), np.zeros(10)), limit_db=30.0)
    assert growth.life.reason == "damage is not sure enough"
    assert growth.probability < 0.5


def test_a_doubted_look_says_nothing():
    maps = tooth_maps(np.random.default_rng(2), np.full(10, 3.0))
    healthy = np.arange(len(maps)) < HEALTHY
    growth = tooth_growth(maps, healthy, np.arange(30.0), doubted=~healthy)
    assert growth.probability < 0.01
    assert growth.per == "day"


@pytest.mark.parametrize("limit", [0.0, 40.0])
def test_the_ends_of_the_limit_are_taken(limit):
    assert grown(tooth_maps(np.random.default_rng(4), np.full(3, 2.0)), limit_db=limit).life is not None
