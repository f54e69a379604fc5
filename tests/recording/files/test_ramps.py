"""Unit: ramps, which are no vibration, and series that are none."""

import numpy as np
import pytest

from sigdb.recording.files.ramps import ramp_kind

K = np.arange(6000)
RNG = np.random.default_rng(3)
STEP = 1 / 12_800


@pytest.mark.parametrize(
    ("x", "kind"),
    [
        (K, "counts"), (K + 7, "counts"), (K[:10], "counts"), (5 * K, "rises"), (K * STEP, "rises"),
        (1.7e9 + K * STEP, "rises"), (-K, "falls"), (100 - K * STEP, "falls"), (np.round(K * STEP, 3), "rises"),
        (K * STEP + RNG.uniform(-0.4, 0.4, K.size) * STEP, "rises"),
        (K * STEP + RNG.normal(0, 0.7, K.size) * STEP, "rises"), (np.delete(K * STEP, slice(900, 1000)), "rises"),
        (np.cumsum(RNG.uniform(0, 1, K.size)), "rises"), (K**1.01, "rises"), (np.where(K == 50, np.nan, K), "rises"),
        (K % 256, "repeats"), (0.36 * K % 360, "repeats"), ((360 - 0.36 * K) % 360, "repeats"),
    ],
)  # fmt: skip
def test_ramps(x, kind):
    assert ramp_kind(np.asarray(x, dtype=float)) == kind


@pytest.mark.parametrize(
    "x",
    [
        RNG.normal(size=6000), np.sin(K / 40), np.sin(K / 40) + 1e-3 * K, np.zeros(6000), np.full(6000, 3.0), K % 7,
        5.0 * (K % 640 < 64), np.cumsum(RNG.normal(size=6000)), K[:7], (K > 3000), K * 0.0 + (K > 2), K % 2 * K,
        np.concatenate([np.zeros(5000), RNG.normal(size=1000)]), np.where(K < 5000, np.nan, RNG.normal(size=6000)),
    ],
)  # fmt: skip
def test_series_that_are_no_ramps(x):
    assert ramp_kind(np.asarray(x, dtype=float)) == ""


@pytest.mark.parametrize("size", [300, 5000])
@pytest.mark.parametrize("spike", [1e7, -1e20])
@pytest.mark.parametrize("seed", range(4))
def test_a_vibration_with_a_huge_spike_is_no_ramp(size, spike, seed):
    x = np.random.default_rng(seed).normal(size=size)
    x[0] = spike
    assert ramp_kind(x) == ""
