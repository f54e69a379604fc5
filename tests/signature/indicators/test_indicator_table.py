"""Indicators against values that follow from their definitions on signals in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb import signature
from sigdb.signature import (
    INDICATORS,
    crest_factor,
    difference_signal,
    energy_operator,
    energy_ratio,
    features,
    fm0,
    fm4,
    indicators,
    kurtosis,
    m6a,
    m8a,
    peak_to_peak,
    regular_signal,
    rms,
    sideband_energy_ratio,
    sideband_index,
    sideband_level_factor,
)

N = 768
THETA = 2 * np.pi * np.arange(N) / N


def test_a_sine():
    x = 2.0 * np.sin(6 * THETA)
    assert_allclose(rms(x), np.sqrt(2), rtol=1e-14)
    assert_allclose(peak_to_peak(x), 4.0, rtol=1e-14)
    assert_allclose(crest_factor(x), np.sqrt(2), rtol=1e-14)
    assert_allclose(kurtosis(x), 1.5, rtol=1e-13)


def test_the_mean_stays_in_rms_and_crest_factor_and_goes_from_kurtosis():
    x = -3.0 + 2.0 * np.cos(6 * THETA)
    assert_allclose(rms(x), np.sqrt(9 + 2), rtol=1e-14)
    assert_allclose(crest_factor(x), 5 / np.sqrt(11), rtol=1e-14)
    assert_allclose(peak_to_peak(x), 4.0, rtol=1e-14)
    assert_allclose(kurtosis(x), 1.5, rtol=1e-13)


def test_crest_factor_is_of_the_modulus():
    assert_allclose(crest_factor([0.0, 0.0, 0.0, -5.0]), 2.0, rtol=1e-15)


def test_moments_of_a_sine_with_offset():
    d = 1e-6 * np.sin(11 * THETA) + 4e-6
    assert_allclose([fm4(d), m6a(d), m8a(d)], [1.5, 2.5, 4.375], rtol=1e-12)


def test_moments_of_an_impulse():
    # One sample in n, the mean removed: sum d^q = (1 - 1/n)^q + (n - 1) / n^q for even q.
    n = 50
    x = np.zeros(n)
    x[17] = -7.0

    def total(q):
        return (1 - 1 / n) ** q + (n - 1) / n**q

    expected = [n ** (q // 2 - 1) * total(q) / total(2) ** (q // 2) for q in (4, 6, 8)]
    assert_allclose([fm4(x), m6a(x), m8a(x)], expected, rtol=1e-13)
    assert_allclose(kurtosis(x), expected[0], rtol=1e-13)


def test_kurtosis_of_two_tones():
    a, b = 1.0, 0.7
    x = a * np.cos(5 * THETA) + b * np.sin(13 * THETA)
    fourth = 3 / 8 * (a**4 + b**4) + 3 / 2 * a**2 * b**2
    assert_allclose(kurtosis(x), fourth / ((a**2 + b**2) / 2) ** 2, rtol=1e-13)


def test_moments_of_gaussian_noise():
    # Five standard errors, sqrt((mu_2q - mu_q^2) / n): more than enough, as the variance is estimated alongside.
    x = np.random.default_rng(20).normal(size=400_000)
    assert_allclose(kurtosis(x), 3.0, atol=5 * np.sqrt(96 / x.size))
    assert_allclose(fm4(x), 3.0, atol=5 * np.sqrt(96 / x.size))
    assert_allclose(m6a(x), 15.0, atol=5 * np.sqrt((10395 - 225) / x.size))
    assert_allclose(m8a(x), 105.0, atol=5 * np.sqrt((2027025 - 11025) / x.size))


def test_energy_operator_of_a_tone_with_a_mean():
    # (c + A cos wi)^2 - (c + A cos w(i-1))(c + A cos w(i+1)) = A^2 sin^2 w + 2 c A (1 - cos w) cos wi: a tone, so 1.5.
    # Without the mean it would be a constant.
    assert_allclose(energy_operator(0.8 + 2.0 * np.cos(30 * THETA)), 1.5, rtol=1e-10)


def test_energy_operator_of_two_tones():
    # Energies of both tones and a beat of the two: constant + C cos((p - q) theta) + D cos((p + q) theta).
    p, q, a, b = 90, 61, 1.0, 0.6
    wp, wq = 2 * np.pi * p / N, 2 * np.pi * q / N
    # From x_i^2 - x_(i-1) x_(i+1), by the product rule for cosines.
    C, D = a * b * (1 - np.cos(wp + wq)), a * b * (1 - np.cos(wp - wq))
    fourth = 3 / 8 * (C**4 + D**4) + 3 / 2 * C**2 * D**2
    x = a * np.cos(p * THETA) + b * np.cos(q * THETA)
    assert_allclose(energy_operator(x), fourth / ((C**2 + D**2) / 2) ** 2, rtol=1e-11)


def test_energy_operator_wraps_around():
    # Two impulses two samples apart across the ends: energies 1, 1 and -1 between them.
    x = np.zeros(40)
    x[[39, 1]] = 1.0
    psi = np.zeros(40)
    psi[[39, 1, 0]] = [1.0, 1.0, -1.0]
    assert_allclose(energy_operator(x), kurtosis(psi), rtol=1e-13)


def test_fm0_of_two_harmonics():
    x = 4.0 + 1.0 * np.cos(12 * THETA) + 0.25 * np.cos(24 * THETA)
    range_ = 1.25 - (-0.75)  # cos u + cos(2u)/4 is least at u = pi
    assert_allclose(fm0(x, teeth=12), range_ / 1.25, rtol=1e-13)
    assert_allclose(fm0(x, teeth=12, mesh_harmonics=1), range_, rtol=1e-13)


def test_fm0_does_not_count_the_nyquist_bin():
    x = np.cos(12 * THETA) + 0.5 * (-1.0) ** np.arange(N)  # the 32nd mesh harmonic is Nyquist
    assert_allclose(fm0(x, teeth=12), np.ptp(x), rtol=1e-13)


def test_sidebands_of_a_modulated_mesh():
    # (1 + 2 a cos theta + 2 b cos 3 theta) cos Z theta has sidebands a at Z +- 1 and b at Z +- 3.
    a, b, mesh = 0.2, 0.05, 1.5
    x = 9.0 + mesh * (1 + 2 * a * np.cos(THETA) + 2 * b * np.cos(3 * THETA)) * np.cos(12 * THETA)
    variance = mesh**2 * (1 + 2 * a**2 + 2 * b**2) / 2
    assert_allclose(sideband_index(x, teeth=12), mesh * a, rtol=1e-12)
    assert_allclose(sideband_level_factor(x, teeth=12), 2 * mesh * a / np.sqrt(variance), rtol=1e-12)
    assert_allclose(sideband_energy_ratio(x, teeth=12), 2 * (a + b), rtol=1e-12)
    assert_allclose(sideband_energy_ratio(x, teeth=12, pairs=2), 2 * a, rtol=1e-12)


def test_unequal_sidebands_are_averaged():
    x = np.cos(12 * THETA) + 0.3 * np.cos(11 * THETA) + 0.1 * np.cos(13 * THETA)
    assert_allclose(sideband_index(x, teeth=12), 0.2, rtol=1e-12)


def test_six_pairs_by_default():
    x = np.cos(12 * THETA) + 0.1 * np.cos(6 * THETA) + 0.2 * np.cos(18 * THETA) + np.cos(5 * THETA) + np.cos(19 * THETA)
    assert_allclose(sideband_energy_ratio(x, teeth=12), 0.3, rtol=1e-12)


def test_sidebands_outside_the_spectrum_count_nothing():
    theta = 2 * np.pi * np.arange(16) / 16
    x = 5.0 + np.cos(theta) + 0.4 * np.cos(2 * theta)
    assert_allclose(sideband_index(x, teeth=1), 0.2, rtol=1e-13)  # order 0 is the mean, not a sideband
    nyquist = np.cos(7 * theta) + 0.4 * np.cos(6 * theta) + (-1.0) ** np.arange(16)
    assert_allclose(sideband_index(nyquist, teeth=7), 0.2, rtol=1e-13)


def test_energy_ratio_of_known_tones():
    x = 3 + 2.0 * np.cos(12 * THETA) + 0.1 * np.cos(11 * THETA) + 0.5 * np.cos(17 * THETA)
    difference, regular = difference_signal(x, teeth=12), regular_signal(x, teeth=12)
    assert_allclose(energy_ratio(difference, regular), 0.25, rtol=1e-12)


def singly(x, teeth, **options):
    """Each indicator by the function of its name."""
    separation = {k: v for k, v in options.items() if k != "sidebands"}
    difference = difference_signal(x, teeth=teeth, **options)
    regular = regular_signal(x, teeth=teeth, **separation)
    scale = np.max(np.abs(x), axis=-1)
    harmonics = {k: v for k, v in options.items() if k == "mesh_harmonics"}
    return {
        "rms": rms(x),
        "peak_to_peak": peak_to_peak(x),
        "crest_factor": crest_factor(x),
        "kurtosis": kurtosis(x),
        "energy_operator": energy_operator(x),
        "fm0": fm0(x, teeth=teeth, **harmonics),
        "fm4": fm4(difference, scale=scale),
        "m6a": m6a(difference, scale=scale),
        "m8a": m8a(difference, scale=scale),
        "energy_ratio": energy_ratio(difference, regular, scale=scale),
        "sideband_index": sideband_index(x, teeth=teeth),
        "sideband_level_factor": sideband_level_factor(x, teeth=teeth),
        "sideband_energy_ratio": sideband_energy_ratio(x, teeth=teeth),
    }


@pytest.mark.parametrize(
    ("n", "teeth", "options"),
    [
        (768, 12, {}),
        (100, 13, {"mesh_harmonics": 2, "shaft_harmonics": 1, "sidebands": 3}),
        (63, 7, {"shaft_harmonics": 0, "sidebands": 0}),
        (64, 3, {"mesh_harmonics": 4}),
    ],
)
def test_all_at_once_is_each_by_itself(n, teeth, options):
    x = 0.3 + np.random.default_rng(n).normal(size=(3, 25, n))  # more signals than a block of them
    together, one_by_one = indicators(x, teeth=teeth, **options), singly(x, teeth, **options)
    for name in INDICATORS:
        assert together[name].shape == (3, 25), name
        assert together[name].dtype == np.float64, name
        assert_allclose(together[name], one_by_one[name], rtol=1e-11, err_msg=name)


def test_one_signal_gives_numbers_and_no_signal_gives_none():
    x = np.random.default_rng(0).normal(size=(1, 96))
    for name, value in indicators(x[0], teeth=8).items():
        assert np.shape(value) == (), name
        assert_allclose(value, indicators(x, teeth=8)[name][0], rtol=1e-12)
    assert all(value.shape == (0,) for value in indicators(x[:0], teeth=8).values())


def test_single_precision_in_double_precision_out():
    x = np.random.default_rng(3).normal(size=(4, 96)).astype(np.float32)
    single, double = indicators(x, teeth=8), indicators(x.astype(np.float64), teeth=8)
    for name in INDICATORS:
        assert single[name].dtype == np.float64
        # The samples are the same numbers, and the arithmetic is double from the first step on.
        assert_allclose(single[name], double[name], rtol=1e-14)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turn=st.integers(-12, 12))
def test_turning_by_teeth_changes_nothing(seed, turn):
    x = 0.5 + np.random.default_rng(seed).normal(size=192)
    before, after = indicators(x, teeth=12), indicators(np.roll(x, 16 * turn), teeth=12)
    for name in INDICATORS:
        assert_allclose(after[name], before[name], rtol=1e-10, err_msg=name)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), exponent=st.integers(-800, 800))
def test_units_scale_three_indicators_and_no_other(seed, exponent):
    x = np.random.default_rng(seed).normal(size=96)
    unit = 2.0**exponent
    before, after = indicators(x, teeth=8), indicators(x * unit, teeth=8)
    after_singly = singly(x * unit, 8)
    for name, indicator in INDICATORS.items():
        factor = unit if indicator.unit == "signal" else 1.0
        assert_allclose(after[name], before[name] * factor, rtol=1e-12, err_msg=name)
        assert_allclose(after_singly[name], before[name] * factor, rtol=1e-11, err_msg=name)


def test_the_sign_of_the_signal_does_not_matter():
    x = np.random.default_rng(5).normal(size=96)
    before, after = indicators(x, teeth=8), indicators(-x, teeth=8)
    for name in INDICATORS:
        assert_allclose(after[name], before[name], rtol=1e-12, err_msg=name)


@pytest.mark.parametrize("name", INDICATORS)
def test_the_value_of_one_signal_is_a_plain_float(name):
    x = np.cos(12 * THETA) + 0.1 * np.cos(13 * THETA) + 0.05 * np.cos(40 * THETA)
    difference, regular = difference_signal(x, teeth=12), regular_signal(x, teeth=12)
    arguments = dict.fromkeys(("fm4", "m6a", "m8a"), (difference,)) | {"energy_ratio": (difference, regular)}
    options = {"teeth": 12} if name == "fm0" or name.startswith("sideband") else {}
    one = getattr(signature, name)(*arguments.get(name, (x,)), **options)
    several = getattr(signature, name)(*([each] for each in arguments.get(name, (x,))), **options)
    assert type(one) is type(indicators(x, teeth=12)[name]) is type(features(x, teeth=12)[name]) is float
    assert several.tolist() == [one]


def test_a_signature_prints_numbers():
    assert "np." not in str(indicators(np.cos(12 * THETA), teeth=12))
