"""The filter against an enumeration of all paths, and its statistic against the recursion of Shiryaev and Roberts."""

import itertools

import numpy as np
import pytest
from scipy.linalg import expm

from sigdb.core import InputError
from sigdb.prognosis import SeverityFilter, paris_crack

LEVELS, RATES, EXPONENTS = [0.1, 0.2, 0.5], [0.02, 0.1], [2.0, 4.0]


def law():
    return paris_crack(LEVELS, rates=RATES, exponents=EXPONENTS, reference=0.2)


def enumerated(log_ratios, elapsed, initiation):
    """Joint probabilities of parameters, tooth and level after the last look, by the sum over all paths."""
    teeth, levels = log_ratios.shape[1:]
    sets = list(itertools.product(RATES, EXPONENTS))
    matrices = []
    for rate, m in sets:
        Q = np.zeros((levels, levels))
        for level in range(levels - 1):
            speed = rate * (LEVELS[level] / 0.2) ** (m / 2)
            Q[level, level + 1] = speed / (LEVELS[level + 1] - LEVELS[level])
            Q[level, level] = -Q[level, level + 1]
        matrices.append([expm(Q * dt) for dt in elapsed])
    states = [None, *itertools.product(range(teeth), range(levels))]
    none, damaged = 0.0, np.zeros((len(sets), teeth, levels))
    for p, path in itertools.product(range(len(sets)), itertools.product(states, repeat=len(log_ratios))):
        probability, before = 1 / len(sets), None
        for n, state in enumerate(path):
            if before is None:
                begins = initiation / teeth / levels
                probability *= 1 - initiation if state is None else begins
            elif state is None or state[0] != before[0]:
                probability = 0.0
            else:
                probability *= matrices[p][n][before[1], state[1]]
            probability *= 1.0 if state is None else np.exp(log_ratios[n][state])
            before = state
        if path[-1] is None:
            none += probability
        else:
            damaged[(p, *path[-1])] += probability
    return none, damaged


def test_the_recursion_is_the_sum_over_all_paths():
    stream = np.random.default_rng(4)
    log_ratios = stream.normal(size=(4, 2, 3))
    elapsed = [0.0, 1.0, 0.5, 3.0]
    none, damaged = enumerated(log_ratios, elapsed, 0.1)
    chain = SeverityFilter(law(), teeth=2, initiation=0.1)
    for look, dt in zip(log_ratios, elapsed, strict=True):
        after = chain.look(look, elapsed=dt)
    total = none + damaged.sum()
    assert after.none == pytest.approx(none / total, rel=1e-10)
    np.testing.assert_allclose(after.damaged, damaged / total, rtol=1e-9)
    assert after.log_evidence == pytest.approx(np.log(total), rel=1e-10)
    np.testing.assert_allclose(after.severity, damaged.sum(axis=(0, 1)) / damaged.sum(), rtol=1e-9)
    np.testing.assert_allclose(after.parameters, damaged.sum(axis=(1, 2)) / damaged.sum(), rtol=1e-9)
    np.testing.assert_allclose(after.teeth, damaged.sum(axis=(0, 2)) / total, rtol=1e-9)


def test_the_change_statistic_is_that_of_shiryaev_and_roberts():
    # One tooth, and no growth: R_n = (1 + R_(n-1)) LR_n; a look k counts with (1 - initiation)^(k - 1) here.
    still = paris_crack([0.1, 0.2], rates=[1e-12], exponents=[2.0], reference=0.1)
    chain, R = SeverityFilter(still, teeth=1, initiation=0.01), 0.0
    for n, log_ratio in enumerate(np.random.default_rng(1).normal(-0.5, 1.0, size=8)):
        after = chain.look(np.full((1, 2), log_ratio), elapsed=1.0)
        R = (0.99**n + R) * np.exp(log_ratio)
        assert after.change_statistic == pytest.approx(R, rel=1e-9)


def test_great_ratios_do_not_overflow():
    chain = SeverityFilter(law(), teeth=2, initiation=1e-6)
    after = chain.look(np.array([[0.0, 0.0, 0.0], [5000.0, 0.0, 0.0]]), elapsed=0.0)
    assert after.teeth[1] == pytest.approx(1.0)
    assert np.isfinite(after.change_statistic)


@pytest.mark.parametrize(
    ("shape", "elapsed", "text"), [((2, 2), 1.0, "teeth and levels"), ((2, 3), -1.0, "order of time")]
)
def test_a_wrong_look_is_refused(shape, elapsed, text):
    with pytest.raises(InputError, match=text):
        SeverityFilter(law(), teeth=2, initiation=0.1).look(np.zeros(shape), elapsed=elapsed)


@pytest.mark.parametrize("initiation", [0.0, 1.0])
def test_an_initiation_is_a_probability(initiation):
    with pytest.raises(InputError, match="between 0 and 1"):
        SeverityFilter(law(), teeth=2, initiation=initiation)
