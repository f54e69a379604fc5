"""Modes of nuisances: against exact changes of an average, and the covariances that they stand for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.measurement import NuisanceSettings, measured_columns, principal_modes, smooth_components

TEETH, N = 4, 32
SIGNAL = np.fft.irfft([0, *np.random.default_rng(1).standard_normal(12) + 1j, *np.zeros(4)], N)
ANGLE = 2 * np.pi * np.arange(N) / N
STEP = 1e-6


def late(passes):
    """The average whose mark comes later: a band-limited signal, shifted."""
    return np.fft.irfft(np.fft.rfft(SIGNAL) * np.exp(-2j * np.pi * passes / TEETH * np.arange(N // 2 + 1)), N)


@pytest.mark.parametrize(
    ("settings", "exact"),
    [
        ({"gain_db": 3.0}, [lambda z: SIGNAL * 10 ** (3.0 * z / 20)]),
        ({"mark": 0.2}, [lambda z: late(0.2 * z)]),
        (
            {"modulation": 0.1},
            [lambda z: SIGNAL * (1 + 0.1 * z * np.cos(ANGLE)), lambda z: SIGNAL * (1 + 0.1 * z * np.sin(ANGLE))],
        ),
    ],
)
def test_columns_are_the_derivatives_of_the_exact_changes(settings, exact):
    columns = measured_columns(SIGNAL, TEETH, NuisanceSettings(**settings))
    expected = np.stack([(change(STEP) - change(-STEP)) / (2 * STEP) for change in exact], axis=1)
    assert_allclose(columns, expected, atol=1e-8)


@pytest.mark.parametrize("distance", [0.5, 2.0, 12.0])
def test_a_smooth_path_has_the_stated_correlation(distance):
    smooth = smooth_components(40, distance)
    apart = np.subtract.outer(np.arange(40), np.arange(40))
    assert_allclose(smooth @ smooth.T, np.exp(-(apart**2) / (2 * distance**2)), atol=0.02)


def test_a_path_changes_each_order_by_its_gain_and_phase():
    settings = NuisanceSettings(path_db=1.0, path_deg=10.0)
    columns = np.fft.rfft(measured_columns(SIGNAL, TEETH, settings), axis=0)
    spectrum = np.fft.rfft(SIGNAL)
    relative = columns[1:13] / spectrum[1:13, None]
    assert_allclose((relative.real**2).sum(axis=1), (np.log(10) / 20) ** 2, rtol=0.02)
    assert_allclose((relative.imag**2).sum(axis=1), np.radians(10) ** 2, rtol=0.02)


def test_nothing_stated_has_no_columns():
    assert measured_columns(SIGNAL, TEETH, NuisanceSettings()).shape == (N, 0)
    assert not NuisanceSettings().exist


def test_principal_modes_have_the_covariance_of_all_columns():
    columns = np.random.default_rng(2).standard_normal((2, N, 200)) * np.array([1.0, 50.0])[:, None, None]
    modes = principal_modes(columns, np.array([1.0, 50.0]))
    flat, few = columns.reshape(2 * N, -1), modes.reshape(2 * N, -1)
    assert few.shape[1] <= 2 * N
    assert_allclose(few @ few.T, flat @ flat.T, atol=1e-2 * 50**2)


def test_small_modes_are_left_out():
    columns = np.stack([SIGNAL, 1e-9 * ANGLE], axis=1)[None]
    assert principal_modes(columns, np.array([SIGNAL.std()])).shape == (1, N, 1)


def test_a_source_of_no_number_is_refused():
    with pytest.raises(InputError, match=r"sources\.gain is of no number of this section"):
        NuisanceSettings(sources={"gain": "a guess"})
