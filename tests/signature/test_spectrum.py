"""Spectrum and separation against tones whose amplitudes are known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb.signature import difference_signal, order_spectrum, regular_signal, residual_signal


def angle(n):
    return 2 * np.pi * np.arange(n) / n


def tones(n, amplitudes):
    """A sum of cosines, amplitude by order, each with a phase of its own."""
    theta = angle(n)
    return sum(a * np.cos(o * theta + 0.3 * o) for o, a in amplitudes.items())


@pytest.mark.parametrize("n", [64, 63])
def test_a_tone_has_its_amplitude_and_phase(n):
    order, c = order_spectrum(2.5 * np.cos(7 * angle(n) + 0.4))
    expected = np.zeros(n // 2 + 1, dtype=complex)
    expected[7] = 2.5 * np.exp(0.4j)
    assert_allclose(c, expected, atol=1e-14)
    assert order.tolist() == list(range(n // 2 + 1))


def test_mean_and_nyquist_are_not_doubled():
    _, c = order_spectrum(3.0 + 0.5 * (-1.0) ** np.arange(16))
    assert_allclose(c, [3.0, 0, 0, 0, 0, 0, 0, 0, 0.5], atol=1e-15)


def test_the_last_bin_of_an_odd_count_is_doubled():
    assert_allclose(np.abs(order_spectrum(np.cos(4 * angle(9)))[1][-1]), 1.0, rtol=1e-14)


def test_the_spectrum_of_a_batch_is_that_of_each():
    x = np.random.default_rng(1).normal(size=(2, 3, 30))
    _, c = order_spectrum(x)
    assert c.shape == (2, 3, 16)
    assert_allclose(c[1, 2], order_spectrum(x[1, 2])[1], rtol=1e-12)


def test_single_precision_in_double_precision_out():
    _, c = order_spectrum(np.ones(8, dtype=np.float32))
    assert c.dtype == np.complex128


AMPLITUDES = {1: 0.4, 2: 0.3, 3: 0.2, 7: 0.11, 8: 1.0, 9: 0.12, 10: 0.05}
AMPLITUDES |= {15: 0.06, 16: 0.5, 17: 0.07, 24: 0.25, 30: 0.02}


def only(n, *orders):
    return tones(n, {o: AMPLITUDES[o] for o in orders})


def test_regular_residual_and_difference_of_known_tones():
    n = 128
    x = 5 + tones(n, AMPLITUDES)
    assert_allclose(regular_signal(x, teeth=8), only(n, 1, 2, 8, 16, 24), atol=1e-13)
    assert_allclose(residual_signal(x, teeth=8), only(n, 3, 7, 9, 10, 15, 17, 30), atol=1e-13)
    assert_allclose(difference_signal(x, teeth=8), only(n, 3, 10, 30), atol=1e-13)


def test_counts_choose_the_orders():
    n = 128
    x = 5 + tones(n, AMPLITUDES)
    options = {"teeth": 8, "mesh_harmonics": 1, "shaft_harmonics": 0}
    assert_allclose(regular_signal(x, **options), only(n, 8), atol=1e-13)
    assert_allclose(residual_signal(x, **options), only(n, 1, 2, 3, 7, 9, 10, 15, 16, 17, 24, 30), atol=1e-13)
    # Sidebands go with the harmonics asked for: those of the second stay.
    assert_allclose(difference_signal(x, **options, sidebands=2), only(n, 1, 2, 3, 15, 16, 17, 24, 30), atol=1e-13)
    assert_allclose(difference_signal(x, **options, sidebands=0), residual_signal(x, **options), atol=1e-15)


def test_no_harmonics_at_all_leave_the_average_without_mean():
    x = 5 + tones(64, {3: 1.0, 8: 1.0})
    options = {"teeth": 8, "mesh_harmonics": 0, "shaft_harmonics": 0}
    assert_allclose(regular_signal(x, **options), np.zeros(64), atol=1e-15)
    assert_allclose(residual_signal(x, **options), x - 5, atol=1e-14)
    assert_allclose(difference_signal(x, **options), x - 5, atol=1e-14)


def test_overlapping_orders_count_once():
    # Teeth 2: shaft orders 1 and 2, mesh orders 2, 4, 6 and their sidebands overlap everywhere.
    x = tones(16, {1: 1.0, 2: 2.0, 3: 3.0, 4: 4.0})
    assert_allclose(regular_signal(x, teeth=2), tones(16, {1: 1.0, 2: 2.0, 4: 4.0}), atol=1e-13)
    assert_allclose(difference_signal(x, teeth=2), np.zeros(16), atol=1e-13)


def test_one_tooth_has_its_lower_sideband_at_the_mean():
    x = 1 + tones(16, {1: 1.0, 2: 2.0, 5: 0.5})
    separated = difference_signal(x, teeth=1, mesh_harmonics=1, shaft_harmonics=0, sidebands=3)
    assert_allclose(separated, tones(16, {5: 0.5}), atol=1e-13)


def test_the_nyquist_bin_is_never_regular():
    # 64 samples, 8 teeth: the fourth mesh harmonic is at Nyquist, order 32; 31 is no sideband of a harmonic below it.
    nyquist = (-1.0) ** np.arange(64)
    x = nyquist + tones(64, {8: 1.0, 24: 1.0, 31: 0.5})
    assert_allclose(regular_signal(x, teeth=8), tones(64, {8: 1.0, 24: 1.0}), atol=1e-13)
    assert_allclose(difference_signal(x, teeth=8), nyquist + tones(64, {31: 0.5}), atol=1e-13)


def test_a_sideband_at_or_above_nyquist_does_not_alias():
    # Mesh order 7 of 16 samples: 8 is Nyquist, 9 and 10 would fold onto 7 and 6.
    x = tones(16, {4: 0.2, 5: 0.3}) + (-1.0) ** np.arange(16)
    separated = difference_signal(x, teeth=7, shaft_harmonics=0, sidebands=3)
    assert_allclose(separated, (-1.0) ** np.arange(16), atol=1e-13)


def test_an_odd_count_of_samples_is_separated_too():
    x = 2 + tones(65, {8: 1.0, 32: 0.7, 31: 0.1, 5: 0.2})
    assert_allclose(regular_signal(x, teeth=8), tones(65, {8: 1.0, 32: 0.7}), atol=1e-13)
    assert_allclose(difference_signal(x, teeth=8), tones(65, {5: 0.2}), atol=1e-13)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(9, 90),
    teeth=st.integers(1, 4),
    sidebands=st.integers(0, 3),
    shaft=st.integers(0, 3),
)
def test_parts_are_orthogonal_and_their_energies_add_up(seed, n, teeth, sidebands, shaft):
    x = np.random.default_rng(seed).normal(size=n)
    regular = regular_signal(x, teeth=teeth, shaft_harmonics=shaft)
    residual = residual_signal(x, teeth=teeth, shaft_harmonics=shaft)
    difference = difference_signal(x, teeth=teeth, shaft_harmonics=shaft, sidebands=sidebands)
    first = residual - difference
    assert_allclose(x.mean() + regular + residual, x, atol=1e-12)
    assert_allclose([regular @ residual, difference @ first, regular.sum(), residual.sum()], 0, atol=1e-11)
    energies = n * x.mean() ** 2 + regular @ regular + first @ first + difference @ difference
    assert_allclose(energies, x @ x, rtol=1e-11)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turn=st.integers(-100, 100))
def test_separation_turns_with_the_signal(seed, turn):
    x = np.random.default_rng(seed).normal(size=96)
    for separate in (regular_signal, residual_signal, difference_signal):
        turned = separate(np.roll(x, turn), teeth=8)
        assert_allclose(turned, np.roll(separate(x, teeth=8), turn), atol=1e-13)
