"""Two damaged teeth apart: their probabilities against hypotheses written out one by one, and on simulated pairs."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import softmax
from scipy.stats import multivariate_normal

import sigdb
from sigdb.core.errors import InputError
from sigdb.dynamics import prepare_periodic
from sigdb.recognition import AverageLaw, Hypotheses, damaged_tooth_probabilities
from sigdb.transmission import ToothDamage

TEETH, STEP = 8, 4


def small_law(teeth=TEETH):
    stream = np.random.default_rng(2)
    n = teeth * STEP
    return AverageLaw(
        teeth=teeth,
        keys=((0,), (1,), (2,)),
        healthy=np.array([True, False, False]),
        severity=np.zeros((3, 3)),
        signal=np.vstack([np.zeros(n), stream.standard_normal((2, n))]),
        response=1e5 * stream.standard_normal((3, n, teeth - 1)),
        harmonic=np.zeros((3, n, 0)),
        phases=np.zeros((3, 0, teeth)),
    )


def test_they_are_the_sums_over_none_one_and_two_damages():
    law, noise, size = small_law(), 1.5, 2e-6
    x = np.random.default_rng(3).standard_normal((3, TEETH * STEP)) + np.roll(law.signal[1], 2 * STEP)
    covariance = noise**2 * np.eye(x.shape[1]) + size**2 * law.response[0] @ law.response[0].T
    ones = [((t,), np.roll(law.signal[k], t * STEP)) for k in (1, 2) for t in range(TEETH)]
    pairs = [
        ((a[0], b[0]), one + other)
        for i, (a, one) in enumerate(ones)
        for b, other in ones[i + 1 :]
        if min(abs(a[0] - b[0]), TEETH - abs(a[0] - b[0])) >= 3
    ]
    hypotheses = [((), np.zeros(x.shape[1])), *ones, *pairs]
    prior = np.log([1.0, *[0.5 / len(ones)] * len(ones), *[0.5 / len(pairs)] * len(pairs)])
    density = np.stack([multivariate_normal.logpdf(x, mean, covariance) for _, mean in hypotheses], axis=1)
    share = softmax(density + prior, axis=1)
    expected = np.stack([share[:, [t in teeth for teeth, _ in hypotheses]].sum(axis=1) for t in range(TEETH)], axis=1)
    assert_allclose(damaged_tooth_probabilities(law, x, noise=noise, index_error=size), expected, atol=1e-9)


def test_teeth_of_rows_with_two_damages_apart_are_damaged_as_often_as_their_probability_says():
    """Teeth with a probability are damaged in that share, where the rows are drawn from the prior."""
    law, noise, size, many = small_law(), 2.0, 2e-6, 4000
    stream = np.random.default_rng(7)
    x = noise * stream.standard_normal((many, TEETH * STEP))
    x += size * stream.standard_normal((many, TEETH - 1)) @ law.response[0].T
    damaged = np.zeros((many, TEETH), dtype=bool)
    for row, some in enumerate(stream.random(many) < 0.5):
        if some:
            first = stream.integers(TEETH)
            damaged[row, [first, (first + stream.integers(3, TEETH - 2)) % TEETH]] = True
            for tooth in np.flatnonzero(damaged[row]):
                x[row] += np.roll(law.signal[stream.integers(1, 3)], tooth * STEP)
    share = damaged_tooth_probabilities(law, x, noise=noise, index_error=size, two_apart=1.0)
    for low, high in ((0.0, 0.1), (0.1, 0.5), (0.5, 0.9), (0.9, 1.0)):
        among = (share >= low) & (share <= high)
        assert among.sum() > 200
        excess = np.where(among, damaged - share, 0.0).sum(axis=1)
        assert abs(excess.sum()) < 4 * np.sqrt((excess**2).sum())


def test_all_damage_is_of_one_tooth_where_a_gear_is_too_small_for_two_apart():
    law, x = small_law(5), np.random.default_rng(3).standard_normal((3, 5 * STEP))
    ones = np.stack([np.roll(law.signal[k], t * STEP) for k in (1, 2) for t in range(5)])
    density = multivariate_normal.logpdf
    terms = np.stack([density(x, mean, np.eye(5 * STEP)) for mean in (np.zeros(5 * STEP), *ones)], axis=1)
    share = softmax(terms + np.log([1.0, *[0.1] * 10]), axis=1)[:, 1:].reshape(3, 2, 5).sum(axis=1)
    assert_allclose(damaged_tooth_probabilities(law, x, noise=1.0, index_error=0.0), share, atol=1e-9)


@pytest.mark.parametrize("teeth", [(2, 8), (5,), ()])
def test_simulated_gears_with_none_one_or_two_damaged_teeth(database, teeth):
    """Responses of both teeth together, not the sum of their changes: each tooth is named, and no other."""
    law = AverageLaw.of(Hypotheses.of(database, speed_rpm=14400.0, torque=356.05, teeth=12))
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    state = prepare_periodic(rig, gear="pinion").steady_state([{t: ToothDamage(stiffness_loss=0.4) for t in teeth}])[0]
    clean = state.signals[list(rig.sensors).index("pinion-vertical")]
    noise = 0.1 * clean.std()
    x = clean + noise * np.random.default_rng(1).standard_normal((20, len(clean)))
    found = damaged_tooth_probabilities(law, x, noise=noise, index_error=1e-7)
    sure = found > 0.9
    assert (sure == np.isin(np.arange(1, 13), teeth)).all(axis=1).mean() > 0.9


def test_averages_that_do_not_fit_are_refused():
    law = small_law()
    with pytest.raises(InputError, match=r"x has the shape \(1, 5\); give rows of 32 samples"):
        damaged_tooth_probabilities(law, np.zeros((1, 5)), noise=1.0, index_error=0.0)
    with pytest.raises(InputError, match="noise = 0 must be above 0"):
        damaged_tooth_probabilities(law, np.zeros((1, 32)), noise=0.0, index_error=0.0)
    with pytest.raises(InputError, match="two_apart = 2 must be a probability"):
        damaged_tooth_probabilities(law, np.zeros((1, 32)), noise=1.0, index_error=0.0, two_apart=2.0)
