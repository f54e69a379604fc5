"""Verification: pulses of the stated size are seen as often as claimed, and smaller ones are not."""

import numpy as np
import pytest

from sigdb.recording.evidence.least_event import least_event
from sigdb.recording.evidence.residual_bands import ResidualBands

TEETH, BANDS, HIGHEST, LIMIT = 24, 4, 24 * 5.5, 12.0


def record(seed):
    """Spectra of 20 revolutions: mesh harmonics, a residual that falls, and noise."""
    stream = np.random.default_rng(seed)
    k = np.arange(TEETH * 5 + 10)
    white = stream.standard_normal((21, 2, k.size)) / (1 + k / TEETH)
    residual = white[:, 0] + 1j * white[:, 1]
    return residual[0] + 0.5 * residual[1:] + 30.0 * (k % TEETH == 0)


def bands_of(spectra):
    return ResidualBands.of(spectra, teeth=TEETH, highest=HIGHEST)


def rms(spectrum):
    return np.sqrt(np.sum(np.abs(spectrum[1:]) ** 2))


@pytest.mark.parametrize(("factor", "low", "high"), [(1.0, 0.85, 1.0), (0.5, 0.0, 0.3)])
def test_pulses_of_the_least_size_are_seen(factor, low, high):
    """At least 51 of 60 pulses are seen: with 0.95 each, fewer have a probability of 1e-3."""
    stream, seen = np.random.default_rng(5), []
    for seed in range(4):
        spectra = record(seed)
        bands, average = bands_of(spectra), spectra.mean(axis=0)
        size = least_event(bands, average, LIMIT)
        for _ in range(15):
            k = np.arange(average.size)
            level = np.interp(k, bands.orders.ravel(), bands.level(average[bands.orders]).ravel(), left=0, right=0)
            phase = stream.random(BANDS)[np.clip((k - TEETH // 2) // TEETH, 0, BANDS - 1)]
            pulse = np.sqrt(level) * np.exp(2j * np.pi * (phase - k * stream.random()))
            pulse *= factor * size * rms(average) / rms(pulse)
            changed = bands_of(spectra + pulse)
            seen.append(changed.pulses((average + pulse)[changed.orders]).ratio > LIMIT)
    assert low <= np.mean(seen) <= high


def test_a_limit_beyond_the_whole_rms_has_no_least_event():
    spectra = record(0)
    assert np.isnan(least_event(bands_of(spectra), spectra.mean(axis=0), 1e9))
