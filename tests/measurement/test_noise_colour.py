"""The colour of noise: its law, its variance, and what revolutions show of it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core.errors import InputError
from sigdb.measurement import (
    NuisanceMixture,
    NuisancePart,
    NuisanceSettings,
    check_revolutions,
    coloured,
    drawn_colours,
    measured_noise,
)

TEETH, N = 8, 256


def test_levels_have_their_deviation_and_their_correlation_over_octaves():
    """From an octave's end to the next the level changes by half the difference of bands that are two apart."""
    settings = NuisanceSettings(colour_db=6.0, colour_octaves=1.5, colours=20_000)
    shapes = drawn_colours(settings, 3, N, TEETH)
    change = 20 * np.log10(shapes[1:, 2 * TEETH] / shapes[1:, TEETH])
    assert_allclose(change.std(), 6.0 * np.sqrt((1 - np.exp(-(2**2) / (2 * 1.5**2))) / 2), rtol=0.03)
    assert abs(change.mean()) < 0.1


def test_white_noise_is_the_first_colour_and_all_have_its_variance():
    shapes = drawn_colours(NuisanceSettings(colour_db=9.0, colours=5), 1, N, TEETH)
    assert shapes.shape == (6, N // 2 + 1)
    assert_allclose(shapes[0], 1.0)
    both_sides = np.concatenate([shapes, shapes[:, -2:0:-1]], axis=1)
    assert_allclose((both_sides**2).mean(axis=1), 1.0)
    noise = coloured(np.random.default_rng(2).standard_normal((6, 400, N)), shapes[:, None])
    assert_allclose(noise.var(axis=(1, 2)), 1.0, rtol=0.1)
    power = (np.abs(np.fft.rfft(noise, axis=2)) ** 2).mean(axis=1) / N
    assert_allclose(power[:, 1:-1] / shapes[:, 1:-1] ** 2, 1.0, atol=0.3)


def test_revolutions_show_noise_with_the_doubt_of_chi_square():
    deviation = np.broadcast_to(np.array([1.0, 2.0, 2.0, 3.0]), (40_000, 4))
    shown = measured_noise(np.random.default_rng(4), deviation, np.array(6))
    assert_allclose((shown**2).mean(axis=0), deviation[0] ** 2, rtol=0.02)
    assert_allclose((shown**2 / deviation**2).var(axis=0), [2 / 5, 1 / 5, 1 / 5, 2 / 5], rtol=0.05)


def test_settings_without_a_colour_are_written_as_before():
    assert not {"colour_db", "colour_octaves", "colours"} & NuisanceSettings(mark=0.1).model_dump().keys()
    stated = NuisanceSettings(colour_db=3.0)
    assert NuisanceSettings.model_validate(stated.model_dump(mode="json")) == stated
    assert stated.exist
    assert NuisanceMixture.of(stated).parts == (NuisancePart(1.0),)


def test_one_revolution_shows_no_colour():
    with pytest.raises(InputError, match=r"averages = 1 shows no scatter between revolutions, and nuisance\.colour_db"):
        check_revolutions(NuisanceSettings(colour_db=3.0), np.array([4.0, 1.0]))
    check_revolutions(NuisanceSettings(), np.array([1.0]))
