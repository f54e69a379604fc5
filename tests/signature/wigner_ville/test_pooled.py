"""The pooled distribution against pooling the whole one, and against signals in closed form."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from sigdb.signature import mesh_bands, pooled_wigner_ville, wigner_ville


def shares(n, teeth):
    """The part of each sample's angle, [i/n, (i+1)/n), within each tooth's, [c/teeth, (c+1)/teeth)."""
    i, c = np.arange(n), np.arange(teeth)[:, None]
    return np.clip(np.minimum((i + 1) / n, (c + 1) / teeth) - np.maximum(i / n, c / teeth), 0, None) * n


def pooled(x, teeth, bands, lag_window, n_bins):
    """Form the distribution, then sum."""
    n = x.shape[-1]
    W = wigner_ville(x, lag_window=lag_window, n_bins=n_bins)
    order = np.arange(W.shape[-1]) * n / (2 * W.shape[-1])
    band = np.array([(low <= order) & (order < high) for low, high in itertools.pairwise(bands)])
    return shares(n, teeth) @ W @ band.T


def close(actual, expected):
    assert actual.shape == expected.shape
    assert_allclose(actual, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


CASES = [
    # n, teeth, lag window, bins
    (96, 8, 24, 96),
    (96, 8, "full", 96),
    (96, 8, 10, 45),
    (100, 12, 16, 100),
    (65, 13, 9, 130),
    (65, 13, "full", 65),
    (48, 5, 24, 60),
    (50, 50, 3, 50),
    (50, 49, 3, 50),
    (31, 7, 0, 31),
    (40, 1, [1.0, 0.5, 0.2, -0.3], 64),
    (40, 6, "full", 47),
    (768, 12, 128, 384),
]


@pytest.mark.parametrize(("n", "teeth", "lag_window", "n_bins"), CASES)
@pytest.mark.parametrize("kind", ["real", "complex"])
def test_equal_to_pooling_the_whole_distribution(n, teeth, lag_window, n_bins, kind):
    rng = np.random.default_rng(n + teeth)
    x = rng.normal(size=n) + (1j * rng.normal(size=n) if kind == "complex" else 0.4)
    for bands in ([0, n / 2], np.linspace(0, n / 2, 8), [1.3, 1.31, 2.0, n / 4, n / 2 - 0.7]):
        F = pooled_wigner_ville(x, teeth=teeth, bands=bands, lag_window=lag_window, n_bins=n_bins)
        expected = pooled(x, teeth, bands, lag_window, n_bins)
        close(F, expected)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 60),
    teeth=st.integers(1, 60),
    extra=st.integers(0, 20),
    data=st.data(),
)
def test_equal_for_any_count_of_samples_and_teeth(seed, n, teeth, extra, data):
    teeth = min(teeth, n)
    L = data.draw(st.integers(0, n // 2))
    x = np.random.default_rng(seed).normal(size=n)
    bands = [0.0, n / 5, n / 2]
    F = pooled_wigner_ville(x, teeth=teeth, bands=bands, lag_window=L, n_bins=2 * L + 1 + extra)
    expected = pooled(x, teeth, bands, L, 2 * L + 1 + extra)
    assert_allclose(F, expected, rtol=0, atol=1e-11 * (1 + np.abs(expected).max()))


@pytest.mark.parametrize(("teeth", "L"), [(12, 16), (24, 8), (5, 24), (3, 24)])
def test_the_default_window_is_two_tooth_passes_and_at_most_a_quarter(teeth, L):
    x = np.random.default_rng(4).normal(size=96)
    bands = np.linspace(0, 48, 6)
    expected = pooled_wigner_ville(x, teeth=teeth, bands=bands, lag_window=np.hamming(2 * L + 1)[L:], n_bins=96)
    close(pooled_wigner_ville(x, teeth=teeth, bands=bands), expected)


def test_an_impulse_stays_in_its_cell():
    z = np.zeros(96, dtype=complex)
    z[16] = 3.0  # the first sample of the third of 12 passes
    F = pooled_wigner_ville(z, teeth=12, bands=[0, 10, 13, 48])
    expected = np.zeros((12, 3))
    expected[2] = [9.0 * 20, 9.0 * 6, 9.0 * 70]  # bins of half an order
    assert_allclose(F, expected, atol=1e-12)


def test_a_sample_across_an_edge_is_shared():
    # 10 samples, 4 teeth: edges at 2.5, 5 and 7.5 samples.
    z = np.zeros((3, 10), dtype=complex)
    z[[0, 1, 2], [2, 5, 7]] = 1.0
    F = pooled_wigner_ville(z, teeth=4, bands=[0, 5])
    assert_allclose(F[:, :, 0], 10 * np.array([[0.5, 0.5, 0, 0], [0, 0, 1, 0], [0, 0, 0.5, 0.5]]), atol=1e-14)


def test_unequal_shares():
    # 8 samples, 3 teeth: edges at 8/3 and 16/3.
    z = np.eye(8, dtype=complex)
    F = pooled_wigner_ville(z, teeth=3, bands=[0, 4], lag_window=0)
    third = 1 / 3
    weights = [[1, 1, 2 * third, 0, 0, 0, 0, 0], [0, 0, third, 1, 1, third, 0, 0], [0, 0, 0, 0, 0, 2 * third, 1, 1]]
    assert_allclose(F[:, :, 0].T, 8 * np.array(weights), atol=1e-14)


def test_all_cells_and_bands_add_up_to_the_energy():
    z = np.random.default_rng(0).normal(size=(77, 2)) @ [1, 1j]
    F = pooled_wigner_ville(z, teeth=9, bands=np.linspace(0, 77 / 2, 12), n_bins=80)
    assert_allclose(F.sum(), 80 * np.sum(np.abs(z) ** 2), rtol=1e-12)


def test_bands_are_half_open():
    # A mean alone, in the full distribution, is bin 0 alone; a tone of order 5 is bin 10, order 5.
    options = {"teeth": 4, "lag_window": "full"}
    mean = pooled_wigner_ville(np.full(32, 2.0), bands=[0, 0.5, 16], **options)
    assert_allclose(mean, np.tile([8 * 32 * 4.0, 0], (4, 1)), atol=1e-10)
    tone = pooled_wigner_ville(np.cos(2 * np.pi * 5 * np.arange(32) / 32), bands=[0, 5, 5.5, 16], **options)
    assert_allclose(tone, np.tile([0, 8 * 32.0, 0], (4, 1)), atol=1e-10)


def test_a_band_without_bins_is_zero():
    x = np.random.default_rng(0).normal(size=32)
    F = pooled_wigner_ville(x, teeth=4, bands=[0.1, 0.2, 3.0], n_bins=32)
    assert_allclose(F[:, 0], 0, atol=1e-12 * np.abs(F).max())


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turn=st.integers(-12, 12))
def test_turning_by_teeth_turns_the_cells(seed, turn):
    x = np.random.default_rng(seed).normal(size=192)
    bands = mesh_bands(12)
    before = pooled_wigner_ville(x, teeth=12, bands=bands)
    after = pooled_wigner_ville(np.roll(x, 16 * turn), teeth=12, bands=bands)
    close(after, np.roll(before, turn, axis=0))


def test_a_feature_means_the_same_for_any_tooth_count():
    # One tooth pass again and again: 64 samples a tooth, 384 bins, 128 lags, as in the database.
    one_pass = np.random.default_rng(6).normal(size=64)
    rows = []
    for teeth in (12, 13, 24, 36):
        x = np.tile(one_pass, teeth)
        F = pooled_wigner_ville(x, teeth=teeth, bands=mesh_bands(teeth), lag_window=128, n_bins=384)
        assert F.shape == (teeth, 17)
        F = F / (384 * x.size / teeth)
        assert_allclose(F, np.tile(F[0], (teeth, 1)), atol=1e-12)
        rows.append(F[0])
    assert_allclose(rows[1:], np.tile(rows[0], (3, 1)), atol=1e-12)


def test_batches_of_any_shape_and_size():
    x = np.random.default_rng(0).normal(size=(2, 70, 50))
    F = pooled_wigner_ville(x, teeth=6, bands=[0, 3, 25])
    assert F.shape == (2, 70, 6, 2)
    close(F, np.array([[pooled_wigner_ville(one, teeth=6, bands=[0, 3, 25]) for one in row] for row in x]))
    assert pooled_wigner_ville(x[:, :0], teeth=6, bands=[0, 25]).shape == (2, 0, 6, 1)


def test_memory_order_and_write_protection_do_not_matter():
    x = np.asfortranarray(np.random.default_rng(0).normal(size=(5, 48)))
    x.flags.writeable = False
    z = x[::-2, ::-1] + 0j
    z.flags.writeable = False
    for signal in (x, x[::2], z):
        close(
            pooled_wigner_ville(signal, teeth=6, bands=[0, 3, 24]),
            pooled_wigner_ville(signal.copy(order="C"), teeth=6, bands=[0, 3, 24]),
        )


@pytest.mark.parametrize(("single", "double"), [(np.float32, np.float64), (np.complex64, np.complex128)])
def test_single_precision_in_double_precision_out(single, double):
    x = np.random.default_rng(0).normal(size=48).astype(single)
    F = pooled_wigner_ville(x, teeth=6, bands=[0, 3, 24])
    assert F.dtype == np.float64
    close(F, pooled_wigner_ville(x.astype(double), teeth=6, bands=[0, 3, 24]))


def test_mesh_bands_of_the_database():
    edges = mesh_bands(12)
    assert edges.size == 18
    assert_allclose(edges, 12 * np.r_[0, np.arange(1, 35, 2) / 8], rtol=1e-15)
    assert edges[-1] == 12 * 4.125
    # 64 samples a tooth and 384 bins: two bins in the first band, three in every other, no bin on an edge.
    order = np.arange(384) * 768 / (2 * 384)
    assert np.histogram(order, edges)[0].tolist() == [2] + [3] * 16
    assert not np.isin(edges[1:], order).any()


def test_mesh_bands_of_other_widths():
    assert_allclose(mesh_bands(9, per_mesh_order=1, mesh_orders=2), [0, 4.5, 13.5, 22.5])
