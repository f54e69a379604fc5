"""Unit: doubt about an average and its indicators is noted with what to look at."""

import numpy as np
import pytest

from sigdb.recording import Channel, Recording, recorded_signature

FS, TEETH = 6400.0, 12
TURNS = 20 * np.arange(int(5 * FS)) / FS


def recording(x):
    tacho = Channel(name="tacho", samples=1.0 * (TURNS % 1 < 0.3), sampling_rate=FS)
    return Recording(source="run.csv", channels=(Channel(name="a1", samples=x, sampling_rate=FS), tacho), tacho="tacho")


def gear(amplitude=1.0, noise=0.1):
    theta = 2 * np.pi * TURNS
    mesh = (1 + 0.3 * np.cos(theta)) * (np.cos(12 * theta) + 0.5 * np.cos(24 * theta))
    return amplitude * mesh + noise * np.random.default_rng(0).standard_normal(theta.size)


def notes(x):
    return {note.code: note for note in recorded_signature(recording(x), teeth=TEETH).notes}


@pytest.mark.parametrize(("amplitude", "little"), [(1.0, False), (0.4, False), (0.1, True)])
def test_an_average_that_keeps_little_is_noted(amplitude, little):
    """The mesh has an rms of 0.8 of its amplitude; noise of 1 and 99 averages leave 0.1 of it."""
    found = notes(gear(amplitude, noise=1.0))
    assert ("little-kept" in found) == little
    if little:
        kept = np.hypot(0.08, 0.1) / np.hypot(0.08, 1)
        assert found["little-kept"].values["kept"] == pytest.approx(kept, rel=0.15)
        assert "check speed, ratio and pulses a revolution" in found["little-kept"].text


@pytest.mark.parametrize("fault", ["clipped", "spikes", "none"])
def test_indicators_that_faults_of_the_samples_spoil_are_named(fault):
    x = gear()
    if fault == "clipped":
        x = np.clip(x, -0.8, 0.8)
    if fault == "spikes":
        x[[5000, 15_000]] += 60
    found = notes(x)
    assert ("spoilt-indicators" in found) == (fault != "none")
    if fault != "none":
        note = found["spoilt-indicators"]
        assert note.values["fault"] == fault
        assert "fm4" in note.values["indicators"]
        assert "rms," not in note.text
        assert "a1" in note.text
