"""The Wigner-Ville distribution against its literal sum, its identities and signals in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb.signature import wigner_ville


def analytic(x):
    """Each DFT bin by itself: mean and Nyquist once, positive orders twice."""
    n = x.size
    i = np.arange(n)
    z = np.zeros(n, dtype=complex)
    for o in range(n // 2 + 1):
        wave = np.exp(2j * np.pi * o * i / n)
        z += (1 if o in (0, n / 2) else 2) * (x @ wave.conj()) / n * wave
    return z


def literal(z, lags, K, boundary):
    """Equation (11) as it stands; ``lags`` holds the weight of every lag, negative ones too."""
    n = z.size

    def at(i):
        if boundary == "circular":
            return z[i % n]
        return z[i] if 0 <= i < n else 0.0

    W = np.zeros((n, K), dtype=complex)
    for i in range(n):
        for k in range(K):
            for m, h in lags.items():
                W[i, k] += h * at(i + m) * np.conj(at(i - m)) * np.exp(-2j * np.pi * m * k / K)
    assert_allclose(W.imag, 0, atol=1e-11 * np.abs(W).max())
    return W.real


def mirrored(half):
    return {m: half[abs(m)] for m in range(1 - len(half), len(half))}


def full_lags(n):
    """n consecutive lags, n/2 once."""
    return dict.fromkeys(range(-((n - 1) // 2), n // 2 + 1), 1.0)


def complex_noise(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=n) + 1j * rng.normal(size=n)


def band_limited(n, seed=0):
    """An analytic signal of even n without mean and Nyquist component, and its DFT."""
    Z = np.zeros(n, dtype=complex)
    Z[1 : n // 2] = complex_noise(n // 2 - 1, seed)
    return np.fft.ifft(Z), Z


@pytest.mark.parametrize("boundary", ["circular", "zero"])
@pytest.mark.parametrize("n", [12, 13])
@pytest.mark.parametrize("K", [11, 12, 13, 20])
def test_the_literal_sum_for_given_weights(boundary, n, K):
    h = [1.0, 0.7, -0.2, 0.4, 0.05, 0.3]
    z = complex_noise(n)
    W = wigner_ville(z, lag_window=h, boundary=boundary, n_bins=K)
    assert_allclose(W, literal(z, mirrored(h), K, boundary), atol=1e-12)


@pytest.mark.parametrize("boundary", ["circular", "zero"])
@pytest.mark.parametrize(("n", "L"), [(12, 3), (13, 4), (18, 0)])
def test_a_half_length_is_a_hamming_window(boundary, n, L):
    x = np.random.default_rng(2).normal(size=n)
    W = wigner_ville(x, lag_window=L, boundary=boundary)
    assert_allclose(W, literal(analytic(x), mirrored(np.hamming(2 * L + 1)[L:]), n, boundary), atol=1e-12)


@pytest.mark.parametrize("n", [12, 13])
@pytest.mark.parametrize("extra", [0, 3])
def test_the_full_circular_window(n, extra):
    z = complex_noise(n)
    lags = full_lags(n)
    if n % 2 == 0 and extra:
        # Off K = n only the two halves of lag n/2 together are real.
        lags |= {n // 2: 0.5, -n // 2: 0.5}
    W = wigner_ville(z, lag_window="full", n_bins=n + extra)
    assert_allclose(W, literal(z, lags, n + extra, "circular"), atol=1e-11)


@pytest.mark.parametrize("n", [12, 13])
def test_the_full_window_between_zeros_has_every_lag(n):
    z = complex_noise(n)
    W = wigner_ville(z, lag_window="full", boundary="zero")
    reach = (n - 1) // 2
    assert_allclose(W, literal(z, dict.fromkeys(range(-reach, reach + 1), 1.0), n, "zero"), atol=1e-11)


def test_defaults_are_circular_hamming_of_sixty_degrees_and_n_bins():
    x = np.random.default_rng(3).normal(size=50)
    expected = wigner_ville(x, lag_window=np.hamming(17)[8:], boundary="circular", n_bins=50)
    assert_allclose(wigner_ville(x), expected, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 40),
    window=st.sampled_from([None, 0, 1, "full"]),
    boundary=st.sampled_from(["circular", "zero"]),
)
def test_the_sum_over_bins_is_the_instantaneous_power(seed, n, window, boundary):
    z = complex_noise(n, seed)
    K = n + 5
    W = wigner_ville(z, lag_window=window, boundary=boundary, n_bins=K)
    assert W.shape == (n, K)
    assert_allclose(W.sum(axis=-1), K * np.abs(z) ** 2, atol=1e-10)


def test_the_power_is_that_of_the_analytic_signal():
    x = 3 * np.cos(2 * np.pi * 5 * np.arange(48) / 48)  # |z| = 3 throughout
    assert_allclose(wigner_ville(x).sum(axis=-1), 48 * 9.0, rtol=1e-12)


@pytest.mark.parametrize("n", [16, 18])
def test_the_marginal_over_angle_is_the_energy_spectrum_and_odd_bins_vanish(n):
    z, Z = band_limited(n)
    marginal = wigner_ville(z, lag_window="full").sum(axis=0)
    assert_allclose(marginal[::2], np.abs(Z[: n // 2]) ** 2, atol=1e-12)
    assert_allclose(marginal[1::2], 0, atol=1e-12)


def test_between_zeros_the_marginal_is_half_and_odd_bins_do_not_vanish():
    z, Z = band_limited(16)
    marginal = wigner_ville(z, lag_window="full", boundary="zero").sum(axis=0)
    assert_allclose(marginal[::2], np.abs(Z[:8]) ** 2 / 2, atol=1e-12)
    assert np.abs(marginal[1::2]).min() > 1e-3 * marginal.max()


def test_moyal():
    (y, _), (z, _) = band_limited(24, 1), band_limited(24, 2)
    product = np.sum(wigner_ville(y, lag_window="full") * wigner_ville(z, lag_window="full"))
    assert_allclose(product, 24 * np.abs(np.vdot(y, z)) ** 2, rtol=1e-12)


def test_full_lags_repeat_half_a_revolution_later():
    W = wigner_ville(complex_noise(20), lag_window="full")
    sign = (-1.0) ** np.arange(20)
    assert_allclose(np.roll(W, -10, axis=0), sign * W, atol=1e-12)


def test_a_window_up_to_a_quarter_has_no_ghost():
    z = np.zeros(48, dtype=complex)
    z[5:8] = [1.0, 2.0j, 1.5]
    W = wigner_ville(z, lag_window=12)
    assert_allclose(np.delete(W, [5, 6, 7], axis=0), 0, atol=1e-13)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turn=st.integers(-40, 40))
def test_the_circular_distribution_turns_with_the_signal(seed, turn):
    x = np.random.default_rng(seed).normal(size=36)
    assert_allclose(wigner_ville(np.roll(x, turn)), np.roll(wigner_ville(x), turn, axis=0), atol=1e-11)


def test_a_tone_is_one_bin_of_the_full_distribution():
    n, order = 32, 5
    W = wigner_ville(3 * np.cos(2 * np.pi * order * np.arange(n) / n + 0.7), lag_window="full")
    expected = np.zeros((n, n))
    expected[:, 2 * order] = n * 9.0
    assert_allclose(W, expected, atol=1e-11)


@pytest.mark.parametrize("K", [64, 33, 100])
def test_a_windowed_tone_is_the_window_s_transform_about_its_order(K):
    n, order, L = 64, 9, 10
    W = wigner_ville(2 * np.cos(2 * np.pi * order * np.arange(n) / n), lag_window=L, n_bins=K)
    m = np.arange(-L, L + 1)
    bins = np.arange(K) * n / (2 * K)  # the order of each bin
    ridge = 4 * np.array([np.sum(np.hamming(2 * L + 1) * np.cos(4 * np.pi * m * (order - o) / n)) for o in bins])
    assert_allclose(W, np.tile(ridge, (n, 1)), atol=1e-11)


def test_two_tones_have_a_cross_term_half_way_between():
    n, a, b = 40, 1.0, 0.6
    i = np.arange(n)
    z = a * np.exp(2j * np.pi * 4 * i / n) + b * np.exp(2j * np.pi * 11 * i / n + 0.5j)
    expected = np.zeros((n, n))
    expected[:, 8] = n * a**2
    expected[:, 22] = n * b**2
    expected[:, 15] = 2 * n * a * b * np.cos(2 * np.pi * 7 * i / n + 0.5)
    assert_allclose(wigner_ville(z, lag_window="full"), expected, atol=1e-11)


def test_a_chirp_is_a_line():
    # z = exp(j pi a i^2 / n) has z[i+m] conj(z[i-m]) = exp(2 pi j m (2 a i) / n): bin 2 a i, modulo n.
    n, a = 32, 3
    i = np.arange(n)
    expected = np.zeros((n, n))
    expected[i, 2 * a * i % n] = n
    assert_allclose(wigner_ville(np.exp(1j * np.pi * a * i**2 / n), lag_window="full"), expected, atol=1e-11)


def test_an_impulse_fills_its_instant():
    z = np.zeros(20, dtype=complex)
    z[3] = 2j
    expected = np.zeros((20, 20))
    expected[3] = 4.0
    assert_allclose(wigner_ville(z), expected, atol=1e-14)
    assert_allclose(wigner_ville(z, lag_window="full", boundary="zero"), expected, atol=1e-14)
    expected[13] = 4.0 * (-1.0) ** np.arange(20)  # full lags: the ghost
    assert_allclose(wigner_ville(z, lag_window="full"), expected, atol=1e-14)


def test_mean_and_nyquist_are_kept_once():
    expected = np.zeros((16, 16))
    expected[:, 0] = 16 * 9.0  # Nyquist is order n/2, one period of the bins: bin 0 too
    assert_allclose(wigner_ville(np.full(16, 3.0), lag_window="full"), expected, atol=1e-12)
    assert_allclose(wigner_ville(3 * (-1.0) ** np.arange(16), lag_window="full"), expected, atol=1e-12)


def test_complex_input_is_not_made_analytic():
    # Order -4 is order n/2 - 4 modulo n/2.
    z = np.exp(-2j * np.pi * 4 * np.arange(32) / 32)
    assert set(wigner_ville(z).argmax(axis=-1)) == {32 - 8}


def test_a_batch_is_each_by_itself():
    x = np.random.default_rng(0).normal(size=(2, 3, 24))
    W = wigner_ville(x, n_bins=30)
    assert W.shape == (2, 3, 24, 30)
    assert_allclose(W[1, 2], wigner_ville(x[1, 2], n_bins=30), atol=1e-13)
    for boundary in ("circular", "zero"):
        assert wigner_ville(x[:, :0], boundary=boundary).shape == (2, 0, 24, 24)


@pytest.mark.parametrize("dtype", [np.float32, np.complex64])
def test_single_precision_in_double_precision_out(dtype):
    x = complex_noise(24).astype(dtype) if dtype is np.complex64 else np.arange(24, dtype=dtype)
    W = wigner_ville(x)
    assert W.dtype == np.float64
    assert_allclose(W, wigner_ville(x.astype(np.complex128 if dtype is np.complex64 else np.float64)), rtol=1e-14)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_shortest_records(n):
    z = complex_noise(n)
    for window in (None, 0, "full"):
        assert_allclose(wigner_ville(z, lag_window=window).sum(axis=-1), n * np.abs(z) ** 2, rtol=1e-12)


@pytest.mark.parametrize("boundary", ["circular", "zero"])
@pytest.mark.parametrize("g", [[1.0, 0.5, 0.25], [1.0], np.hamming(9)[4:]])
def test_the_literal_smoothing_along_the_revolution(boundary, g):
    n, L = 14, 4
    z = complex_noise(n)
    W = literal(z, mirrored(np.hamming(2 * L + 1)[L:]), n, boundary)
    weights = mirrored(g)
    expected = np.zeros((n, n))
    for i in range(n):
        for p, weight in weights.items():
            if boundary == "circular" or 0 <= i - p < n:
                expected[i] += weight * W[(i - p) % n] / sum(weights.values())
    assert_allclose(wigner_ville(z, lag_window=L, time_window=g, boundary=boundary), expected, atol=1e-11)


def test_a_half_length_in_time_is_a_hamming_window():
    x = np.random.default_rng(2).normal(size=40)
    assert_allclose(wigner_ville(x, time_window=6), wigner_ville(x, time_window=np.hamming(13)[6:]), atol=1e-12)
    assert_allclose(wigner_ville(x, time_window=0), wigner_ville(x), atol=1e-12)


def test_smoothing_takes_the_cross_term_of_two_tones_down():
    # The cross-term goes with cos(2 pi 7 i / n): smoothing multiplies it by the window's transform at order 7.
    n, G = 40, 5
    i = np.arange(n)
    z = np.exp(2j * np.pi * 4 * i / n) + 0.6 * np.exp(2j * np.pi * 11 * i / n)
    g = np.hamming(2 * G + 1)
    gain = np.sum(g * np.cos(2 * np.pi * 7 * np.arange(-G, G + 1) / n)) / g.sum()
    expected = np.zeros((n, n))
    expected[:, 8], expected[:, 22] = n, n * 0.36
    expected[:, 15] = gain * 2 * n * 0.6 * np.cos(2 * np.pi * 7 * i / n)
    assert abs(gain) < 0.2
    assert_allclose(wigner_ville(z, lag_window="full", time_window=G), expected, atol=1e-11)


def test_smoothing_keeps_the_energy_and_turns_with_the_signal():
    x = np.random.default_rng(7).normal(size=36)
    W = wigner_ville(x, time_window=7)
    assert_allclose(W.sum(), wigner_ville(x).sum(), rtol=1e-12)
    assert_allclose(wigner_ville(np.roll(x, 5), time_window=7), np.roll(W, 5, axis=0), atol=1e-11)


def test_the_weight_on_the_record():
    # The paper's form: the record, weighted, between zeros, all its lags.
    n = 13
    x, w = np.random.default_rng(2).normal(size=n), np.hamming(n)
    lags = dict.fromkeys(range(-(n - 1) // 2, (n - 1) // 2 + 1), 1.0)
    W = wigner_ville(x, record_window=w, lag_window="full", boundary="zero")
    assert_allclose(W, literal(w * analytic(x), lags, n, "zero"), atol=1e-12)
    assert_allclose(W.sum(axis=-1), n * np.abs(w * analytic(x)) ** 2, rtol=1e-11)


def test_a_weighted_tone():
    # z = w e^(j o theta): a ridge at the tone whose shape is the transform of w[i+m] w[i-m].
    n, order = 33, 6
    w = np.hanning(n)
    z = np.exp(2j * np.pi * order * np.arange(n) / n)
    W = wigner_ville(z, record_window=w, lag_window="full", boundary="zero")
    i, m = n // 2, np.arange(-(n // 2), n // 2 + 1)
    ridge = [np.sum(w[i + m] * w[i - m] * np.cos(2 * np.pi * m * (2 * order - k) / n)) for k in range(n)]
    assert_allclose(W[i], ridge, atol=1e-11)
