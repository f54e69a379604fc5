"""Modes of nuisances: against exact changes of an average, and the covariances that they stand for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.measurement import NuisanceSettings, late, measured_columns, principal_modes
from sigdb.measurement.nuisance import path_components

TEETH, N = 4, 32
SIGNAL = np.fft.irfft([0, *np.random.default_rng(1).standard_normal(12) + 1j, *np.zeros(4)], N)
ANGLE = 2 * np.pi * np.arange(N) / N
STEP = 1e-6


@pytest.mark.parametrize(
    ("settings", "exact"),
    [
        ({"gain_db": 3.0}, [lambda z: SIGNAL * 10 ** (3.0 * z / 20)]),
        ({"mark": 0.2}, [lambda z: late(SIGNAL[None], np.array([0.2 * z]), TEETH)[0]]),
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


@pytest.mark.parametrize(("distance", "gain", "phase"), [(0.5, 0.2, 0.3), (2.0, 0.6, 0.7), (12.0, 1e-3, 0.0)])
def test_a_path_has_the_second_moments_of_random_ones(distance, gain, phase):
    stream = np.random.default_rng(3)
    apart = np.subtract.outer(np.arange(10), np.arange(10)) / distance
    root = np.linalg.cholesky(np.exp(-(apart**2) / 2) + 1e-9 * np.eye(10))
    a, b = (stream.standard_normal((100_000, 10)) @ root.T for _ in range(2))
    paths = np.exp(gain * a + 1j * phase * b) - 1
    real, imaginary = path_components(10, distance, gain, phase)
    size = np.mean(np.abs(paths) ** 2)
    for part, components in ((paths.real, real), (paths.imag, imaginary)):
        assert_allclose(components @ components.T, part.T @ part / len(part), atol=0.03 * size)


def test_a_small_path_changes_each_order_by_its_gain_and_phase():
    settings = NuisanceSettings(path_db=0.1, path_deg=1.0)
    columns = np.fft.rfft(measured_columns(SIGNAL, TEETH, settings), axis=0)
    spectrum = np.fft.rfft(SIGNAL)
    relative = columns[1:13] / spectrum[1:13, None]
    assert_allclose((relative.real**2).sum(axis=1), (0.1 * np.log(10) / 20) ** 2, rtol=0.02)
    assert_allclose((relative.imag**2).sum(axis=1), np.radians(1) ** 2, rtol=0.02)


def test_a_mark_that_is_late_by_a_pass_turns_the_average_by_a_tooth():
    turned = late(np.stack([SIGNAL, SIGNAL]), np.array([0.0, 1.0]), TEETH)
    assert_allclose(turned, [SIGNAL, np.roll(SIGNAL, N // TEETH)], atol=1e-12)


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
