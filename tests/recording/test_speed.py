"""Scores of speeds: the greatest within a reach, and sums over orders. Evidence: unit."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d

from sigdb.recording.speed import find_speed, greatest_within

FS, TEETH = 2000.0, 8


@pytest.mark.parametrize("reach", [1, 2, 7, 31, 40])
def test_the_greatest_within_a_reach_is_that_of_scipy(reach: int) -> None:
    scores = np.random.default_rng(reach).exponential(size=(3, 41)).astype(np.float32)
    expected = maximum_filter1d(scores, 2 * reach + 1, axis=1, mode="constant")
    np.testing.assert_array_equal(greatest_within(scores, reach), expected)


def test_neither_a_channel_s_unit_nor_its_offset_moves_the_speed() -> None:
    t = np.arange(int(20 * FS)) / FS
    turns = 20 * t + 0.02 * np.sin(2 * np.pi * 0.1 * t)
    mesh = (1 + 0.3 * np.cos(2 * np.pi * turns)) * np.cos(2 * np.pi * TEETH * turns)
    x = mesh + 0.1 * np.random.default_rng(2).normal(size=t.size)
    one, other = (find_speed(each[None], FS, teeth=TEETH, range_rpm=(1000.0, 1400.0)) for each in (x, 1e-9 * (x - 5)))
    np.testing.assert_array_equal(one.speed_rpm, other.speed_rpm)
    assert np.abs(one.speed_rpm / 1200 - 1).max() < 0.005
