"""Growth laws against the Poisson law and closed forms of the differential equations."""

import numpy as np
import pytest
from scipy.stats import poisson

from sigdb.core import InputError
from sigdb.prognosis import archard_wear, joined_laws, paris_crack, pit_count


def test_pits_come_by_the_poisson_law():
    (after,) = pit_count(30, rates=[0.7]).transition(2.0)
    np.testing.assert_allclose(after[0, :20], poisson.pmf(np.arange(20), 1.4), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(after.sum(axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("law", "exact"),
    [
        (lambda a: paris_crack(a, rates=[0.1], exponents=[2.0], reference=1.0), np.exp(0.5)),
        (lambda a: paris_crack(a, rates=[0.1], exponents=[4.0], reference=1.0), 1 / (1 - 0.5)),
        (lambda a: archard_wear(a, rates=[0.1]), 1.5),
    ],
)
def test_the_mean_growth_is_that_of_the_law(law, exact):
    # da/dt = 0.1 a^(m / 2) from 1 over a time of 5: exp(0.1 t), 1 / (1 - 0.1 t), and 1 + 0.1 t.
    levels = np.linspace(1.0, 6.0, 301)
    after = law(levels).transition(5.0)[0, 0]
    assert after @ levels == pytest.approx(exact, rel=0.01)


def test_growth_beyond_a_prior_is_ten_times_slower_to_ten_times_faster_in_powers_of_its_own():
    # Speeds rate a^(m / 2) with m of 2 and 4, and rates of 0.1 and 0.4, at the geometric middle, here 1.
    levels = np.append(np.geomspace(0.25, 4.0, 9), 6.0)
    beyond = paris_crack(levels, rates=[0.1, 0.4], exponents=[2.0, 4.0], reference=1.0).wider
    speeds = beyond.step_rates * np.diff(levels)
    powers = np.diff(np.log(speeds), axis=1) / np.diff(np.log(levels[:-1]))
    np.testing.assert_allclose(np.ptp(powers, axis=1), 0, atol=1e-9)
    np.testing.assert_allclose(np.unique(powers[:, 0].round(9)), [-1, 0, 1, 2, 3, 4])
    assert speeds[:, 4].min() == pytest.approx(0.1 / 10)
    assert speeds[:, 4].max() == pytest.approx(0.4 * 10)
    assert beyond.weights.sum() == pytest.approx(1)
    # Equally likely speeds: on a grid of equal ratios each has a weight in proportion to itself.
    np.testing.assert_allclose(beyond.weights / beyond.weights[0], speeds[:, 4] / speeds[0, 4])


def test_joined_laws_are_equally_likely():
    levels = [1.0, 2.0, 3.0]
    both = joined_laws(
        [archard_wear(levels, rates=[1.0]), paris_crack(levels, rates=[1, 2], exponents=[2], reference=1)]
    )
    assert both.weights.tolist() == [0.5, 0.25, 0.25]
    assert both.name == "Archard wear or Paris crack"
    with pytest.raises(InputError, match="different levels"):
        joined_laws([both, pit_count(3, rates=[1.0]), pit_count(4, rates=[1.0])])


@pytest.mark.parametrize("levels", [[1.0], [2.0, 1.0], [0.0, 1.0]])
def test_levels_rise_from_above_zero(levels):
    with pytest.raises(InputError, match="must rise from above 0"):
        archard_wear(levels, rates=[1.0])


def test_rates_are_positive():
    with pytest.raises(InputError, match="greater than 0"):
        pit_count(3, rates=[0.0])
