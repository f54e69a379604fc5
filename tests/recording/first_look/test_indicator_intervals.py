"""Intervals of indicators: their coverage over repeated recordings, and their groups of revolutions."""

import numpy as np
import pytest

from sigdb.recording.first_look.indicator_intervals import indicator_intervals
from sigdb.signature import INDICATORS, indicators

N, TEETH = 192, 12


def gear(revolutions, noise, rng):
    theta = 2 * np.pi * np.arange(N) / N
    one_turn = np.cos(12 * theta) + 0.3 * np.cos(13 * theta) + 0.4 * np.cos(24 * theta + 1)
    one_turn += 0.8 * np.exp(-(((theta - 3) * 4) ** 2)) * np.cos(30 * theta)
    return np.tile(one_turn, revolutions) + rng.normal(0, noise, revolutions * N)


def test_they_cover_the_mean_over_repetitions():
    """At least 89 % of 150 recordings hold the mean over 600 others: 95 % less three standard deviations."""
    rng = np.random.default_rng(7)
    averages = np.array([gear(96, 0.5, rng).reshape(96, N).mean(axis=0) for _ in range(600)])
    truth = {name: values.mean() for name, values in indicators(averages, teeth=TEETH).items()}
    inside = dict.fromkeys(INDICATORS, 0)
    for _ in range(150):
        table = indicator_intervals(gear(96, 0.5, rng), samples_per_rev=N, teeth=TEETH, averages=96)
        table = table.set_index("indicator")
        for name in inside:
            inside[name] += table.loc[name, "low"] <= truth[name] <= table.loc[name, "high"]
    for name, count in inside.items():
        assert count / 150 >= 0.89, name


def test_they_shrink_with_the_root_of_the_revolutions():
    rng = np.random.default_rng(3)
    widths = []
    for revolutions in (64, 1024):
        table = indicator_intervals(
            gear(revolutions, 0.5, rng), samples_per_rev=N, teeth=TEETH, averages=revolutions
        ).set_index("indicator")
        widths.append(table.loc["rms", "high"] - table.loc["rms", "low"])
    assert widths[0] / widths[1] == pytest.approx(4, rel=0.4)


def test_without_noise_they_are_points():
    x = gear(40, 0.0, np.random.default_rng(0))
    table = indicator_intervals(x, samples_per_rev=N, teeth=TEETH, averages=40).set_index("indicator")
    assert table.loc["fm4", "low"] == pytest.approx(table.loc["fm4", "high"])
    assert list(table.index) == list(INDICATORS)


def test_whole_tooth_cycles_keep_the_mate_out():
    """A mate that repeats each second revolution is no scatter where groups hold whole cycles."""
    theta = 2 * np.pi * np.arange(60 * N) / N
    x = gear(60, 0.0, np.random.default_rng(0)) + np.cos(6.5 * theta)
    by_cycle = indicator_intervals(x, samples_per_rev=N, teeth=TEETH, averages=60, cycle=2).set_index("indicator")
    without = indicator_intervals(x, samples_per_rev=N, teeth=TEETH, averages=60, cycle=15).set_index("indicator")
    assert by_cycle.loc["rms", "high"] == pytest.approx(by_cycle.loc["rms", "low"])
    assert without.loc["rms", "high"] - without.loc["rms", "low"] >= 0


def test_too_few_revolutions_give_none():
    table = indicator_intervals(gear(9, 0.1, np.random.default_rng(0)), samples_per_rev=N, teeth=TEETH, averages=9)
    assert table[["low", "high"]].isna().all(axis=None)
