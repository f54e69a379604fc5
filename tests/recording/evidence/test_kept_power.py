"""Unit: power that an average keeps, against the same sums in NumPy."""

import numpy as np
import pytest

from sigdb.recording.evidence.kept_power import kept_power


def test_the_powers_are_those_of_the_interpolated_revolutions():
    stream, revolutions, each, n = np.random.default_rng(0), 7, 3, 50
    x = 4 + stream.normal(size=500)
    pulses = 20 + np.cumsum(stream.uniform(18, 22, revolutions * each + 2))
    places = np.interp(np.arange(revolutions * n) * each / n, np.arange(len(pulses)), pulses)
    turns = np.interp(places, np.arange(len(x)), x - x.mean()).reshape(revolutions, n)
    expected = np.mean(turns.mean(axis=0) ** 2), np.mean(turns**2)
    assert kept_power(x, x.mean(), pulses, each, revolutions, n) == pytest.approx(expected, rel=1e-12)


def test_pulses_beyond_the_record_take_its_last_sample():
    kept, power = kept_power(np.ones(10), 0.0, np.array([0.0, 8.0, 16.0]), 1, 2, 8)
    assert (kept, power) == (1.0, 1.0)
