"""Signals without variance: nan without a warning, by the rule sum d^2 <= n (64 eps s)^2, and nowhere else."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.signature import (
    INDICATORS,
    crest_factor,
    energy_operator,
    energy_ratio,
    fm0,
    fm4,
    indicators,
    kurtosis,
    m6a,
    m8a,
    peak_to_peak,
    rms,
    sideband_energy_ratio,
    sideband_index,
    sideband_level_factor,
)

N = 192
THETA = 2 * np.pi * np.arange(N) / N
EPS = np.finfo(np.float64).eps
WITH_UNIT = ["rms", "peak_to_peak", "sideband_index"]
QUOTIENTS = [name for name in INDICATORS if name not in WITH_UNIT]


@pytest.mark.parametrize("level", [0.0, 0.1, -7e-9, 1e12])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_constant_has_rms_and_range_and_no_quotient(level, dtype):
    values = indicators(np.full((2, N), level, dtype=dtype), teeth=12)
    assert_allclose(values["rms"], abs(dtype(level)), rtol=1e-14)
    assert_allclose(values["peak_to_peak"], 0.0, atol=0)
    assert_allclose(values["sideband_index"], 0.0, atol=1e-14 * abs(level))
    for name in QUOTIENTS:
        assert np.isnan(values[name]).all(), name


@pytest.mark.parametrize("level", [0.0, 0.1])
def test_each_function_of_a_constant(level):
    x = np.full(N, level)
    quotients = [
        crest_factor(x),
        kurtosis(x),
        energy_operator(x),
        fm0(x, teeth=12),
        fm4(x),
        m6a(x),
        m8a(x),
        energy_ratio(x, x),
        sideband_level_factor(x, teeth=12),
        sideband_energy_ratio(x, teeth=12),
    ]
    assert np.isnan(quotients).all()
    assert_allclose([rms(x), peak_to_peak(x), sideband_index(x, teeth=12)], [level, 0.0, 0.0], atol=1e-15)


def test_only_the_constant_of_a_batch_is_nan():
    x = np.random.default_rng(0).normal(size=(3, N))
    x[1] = 4.0
    values = indicators(x, teeth=12)
    for name in QUOTIENTS:
        assert np.isnan(values[name]).tolist() == [False, True, False], name


def test_a_pure_mesh_has_no_difference():
    # What separation leaves is rounding, which by itself looks like a signal: the average's scale tells.
    values = indicators(1e-9 * np.cos(12 * THETA), teeth=12)
    assert np.isnan([values[name] for name in ("fm4", "m6a", "m8a")]).all()
    assert_allclose(values["energy_ratio"], 0.0, atol=1e-14)
    assert_allclose(values["fm0"], 2.0, rtol=1e-12)
    assert_allclose(values["kurtosis"], 1.5, rtol=1e-12)


def test_a_signal_without_mesh_has_no_quotient_over_it():
    values = indicators(np.cos(5 * THETA) + 0.5 * np.cos(17 * THETA), teeth=12)
    assert np.isnan([values[name] for name in ("fm0", "sideband_energy_ratio", "energy_ratio")]).all()
    assert np.isfinite([values[name] for name in ("fm4", "kurtosis", "sideband_level_factor")]).all()


def test_the_energy_of_a_tone_is_constant():
    # x_n^2 - x_(n-1) x_(n+1) of A cos(w n + p) is A^2 sin^2 w.
    for order in (1, 12, 40):
        assert np.isnan(energy_operator(3e5 * np.cos(order * THETA + 0.3)))
        assert np.isnan(energy_operator((3e5 * np.cos(order * THETA + 0.3)).astype(np.float32)))


# A tone of amplitude a has sum d^2 = n a^2 / 2: the rule's limit is a = sqrt(2) 64 eps s.
LIMIT = np.sqrt(2) * 64 * EPS


@pytest.mark.parametrize("moment", [fm4, m6a, m8a])
def test_the_limit_for_a_difference_of_given_scale(moment):
    tone = np.sin(5 * THETA)
    assert np.isnan(moment(0.999 * LIMIT * 30.0 * tone, scale=30.0))
    assert np.isfinite(moment(1.001 * LIMIT * 30.0 * tone, scale=30.0))
    assert np.isfinite(moment(1e-3 * LIMIT * tone))


def test_the_scale_may_differ_from_signal_to_signal():
    tone = np.sin(5 * THETA) * np.ones((2, 1))
    assert np.isnan(fm4(tone, scale=[1.0, 1e15])).tolist() == [False, True]


def test_single_precision_has_a_limit_of_its_own():
    limit = np.sqrt(2) * 64 * np.finfo(np.float32).eps
    tone = np.sin(5 * THETA)
    assert np.isnan(fm4((0.99 * limit * tone).astype(np.float32), scale=1.0))
    assert np.isfinite(fm4((1.01 * limit * tone).astype(np.float32), scale=1.0))
    assert np.isfinite(fm4(0.99 * limit * tone, scale=1.0))


def test_all_at_once_takes_the_precision_of_the_average():
    x = np.cos(12 * THETA) + 20 * np.finfo(np.float32).eps * np.cos(5 * THETA)
    assert np.isnan(indicators(x.astype(np.float32), teeth=12)["fm4"])
    assert_allclose(indicators(x, teeth=12)["fm4"], 1.5, rtol=1e-6)


@pytest.mark.parametrize("indicator", [kurtosis, crest_factor, lambda x: sideband_level_factor(x, teeth=12)])
def test_the_limit_for_an_average_about_its_mean(indicator):
    # The mean's rounding, of an eps or so, moves the limit a little.
    assert np.isnan(indicator(1 + 0.97 * LIMIT * np.cos(5 * THETA)))
    assert np.isfinite(indicator(1 + 1.03 * LIMIT * np.cos(5 * THETA)))


def test_the_limit_for_a_mesh_in_a_larger_signal():
    large, mesh = np.cos(5 * THETA), np.cos(12 * THETA)
    for indicator in (fm0, sideband_energy_ratio):
        assert np.isnan(indicator(large + 0.9 * LIMIT * mesh, teeth=12))
        assert np.isfinite(indicator(large + 1.1 * LIMIT * mesh, teeth=12))


def test_the_limit_for_the_energy_goes_with_the_square():
    # Energy of c + a cos wi: a tone of amplitude 2 c a (1 - cos w) on a constant; the scale squared is about c^2.
    c, w = 1e3, 2 * np.pi * 48 / N
    limit = LIMIT * c / (2 * (1 - np.cos(w)))
    assert np.isnan(energy_operator(c + 0.95 * limit * np.cos(48 * THETA)))
    assert np.isfinite(energy_operator(c + 1.1 * limit * np.cos(48 * THETA)))


def test_energy_ratio_is_nan_without_a_regular_signal_and_zero_without_a_difference():
    tone, nothing = np.cos(5 * THETA), np.zeros(N)
    assert np.isnan(energy_ratio(tone, nothing))
    assert_array_equal(energy_ratio(nothing, tone), 0.0)
    # By default the larger of the two is the scale: a regular signal of mere rounding is none.
    assert np.isnan(energy_ratio(tone, 1e-16 * np.cos(12 * THETA)))
    assert np.isnan(energy_ratio(tone, 1e-3 * tone, scale=1e12))
    assert np.isfinite(energy_ratio(tone, 1e-3 * tone))


@pytest.mark.parametrize("n", [3, 4])
def test_the_shortest_signals(n):
    x = np.arange(n, dtype=float)
    values = indicators(x, teeth=1, shaft_harmonics=1)
    assert_allclose(values["peak_to_peak"], n - 1)
    assert np.isnan(kurtosis([2.0]))
    assert_array_equal(rms([-2.0]), 2.0)
