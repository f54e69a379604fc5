"""The shape of noise: bands of orders, levels that rows of one noise share, and averages with white noise."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.measurement import order_bands, shape_of
from sigdb.recognition import Batch
from sigdb.recognition.noise.noise_shape import band_orders, noise_levels, whitened

TEETH, N = 8, 256
K = np.arange(N // 2 + 1)
LOW = 1 / np.sqrt(1 + (K / TEETH) ** 2)


def estimates(stream, rows, deviation, revolutions=102):
    """Deviations by order, as the revolutions of each row show them."""
    freedom = 2 * (revolutions - 1)
    return deviation * np.sqrt(stream.chisquare(freedom, (rows, len(deviation))) / freedom)


def test_bands_are_octaves_of_the_mesh_order_and_hold_each_order_once():
    assert band_orders(N, TEETH) == [(0, 3), (4, 7), (8, 15), (16, 31), (32, 63), (64, 128)]
    assert_array_equal(np.diff(order_bands(N, TEETH)) >= 0, True)


def test_rows_of_white_noise_are_white_whatever_their_estimates():
    levels = noise_levels(estimates(np.random.default_rng(1), 500, np.full(len(K), 3.0)), TEETH)
    assert not levels[:, 2:].any()
    assert (levels[:, :2] != 0).mean() < 0.2  # four orders only


def test_rows_of_one_noise_share_few_shapes():
    levels = noise_levels(estimates(np.random.default_rng(2), 500, LOW), TEETH)
    assert len(np.unique(levels[:, 2:], axis=0)) <= 16
    assert (np.ptp(levels, axis=0)[2:] <= 1).all()


def test_the_shape_is_that_of_the_noise():
    """A level is rounded to a decibel, and bands of the low-pass are no straight lines."""
    levels = noise_levels(LOW[None], TEETH)[0]
    ratio = 20 * np.log10(shape_of(levels, N, TEETH) / LOW)
    assert np.abs(ratio - ratio.mean()).max() < 1.5


def test_coloured_noise_becomes_white():
    stream = np.random.default_rng(3)
    shape = shape_of(np.array([6, 3, 0, -3, -6, -9]), N, TEETH)
    noise = np.fft.irfft(np.fft.rfft(stream.standard_normal((4000, N)), axis=1) * shape, N, axis=1)
    white = whitened(noise, shape)
    power = (np.abs(np.fft.rfft(white, axis=1)) ** 2).mean(axis=0) / N
    assert_allclose(power[1:-1], 1.0, rtol=0.12)


@pytest.mark.parametrize("deviation", [np.full(len(K), 2.0), 2 * LOW])
def test_the_level_of_a_row_is_that_of_its_whitened_noise(deviation):
    stream = np.random.default_rng(4)
    rows = pd.DataFrame({"teeth": TEETH, "averages": 16.0, "scatter": 8.0}, index=range(3))
    tsa = [stream.standard_normal(N) for _ in range(3)]
    noise = Batch.from_rows(rows.assign(tsa=tsa, noise=[deviation] * 3), {"tsa"}).row_noise()
    variance = (deviation / shape_of(noise.levels[0], N, TEETH)) ** 2
    assert_allclose(noise.level**2, variance[1:-1].mean(), rtol=0.02)
    assert_allclose(Batch.from_rows(rows.assign(tsa=tsa), {"tsa"}).row_noise().level, 2.0)
    none = Batch.from_rows(rows.assign(tsa=tsa, noise=[np.empty(0)] * 3), {"tsa"}).row_noise()
    assert_allclose(none.level, 2.0)
    silent = Batch.from_rows(rows.assign(tsa=tsa, noise=[0 * deviation] * 3), {"tsa"}).row_noise()
    assert_allclose(silent.level, 2.0)
    assert not silent.levels.any()
