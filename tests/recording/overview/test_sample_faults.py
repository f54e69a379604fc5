"""Unit: clipping, spikes and drop-outs, and signals that have none."""

import numpy as np
import pytest

from sigdb.recording.overview.sample_faults import clipped_runs, drop_out_runs, runs_of, spike_runs

N = 20_000
K = np.arange(N)
RNG = np.random.default_rng(4)
NOISE = RNG.normal(size=N)
MESH = np.cos(2 * np.pi * K * 480 / 12_800) * (1 + 0.3 * np.cos(2 * np.pi * K / 640)) + 0.1 * RNG.normal(size=N)
IMPACTS = np.convolve(K % 640 == 0, np.exp(-np.arange(60) / 10) * np.sin(1.7 * np.arange(60)))[:N] + 0.01 * NOISE
TACHO = 5.0 * (K % 640 < 64)
LIVE = {"noise": NOISE, "mesh": MESH, "impacts": IMPACTS, "laplace": RNG.laplace(size=N)}
SOUND = LIVE | {
    "sine": np.sin(2 * np.pi * K * 50 / 12_800), "periodic": np.sin(2 * np.pi * K / 40), "tacho": TACHO,
    "noisy tacho": TACHO + 0.01 * NOISE, "square": np.sign(np.sin(K / 60 + 0.1)), "drift": np.cumsum(NOISE),
    "narrow tacho": 5.0 * (K % 640 == 0) + 0.01 * NOISE, "constant": np.full(N, 2.0), "zero": np.zeros(N),
    "smooth tacho": np.round(1000 * np.exp(-(((K % 640) - 100) ** 2) / 200)),
}  # fmt: skip


def in_bits(x, bits):
    largest = np.abs(x).max()
    return np.round(x / largest * 2 ** (bits - 1)) if largest else x


@pytest.mark.parametrize("bits", [0, 8, 12, 16])
@pytest.mark.parametrize("name", SOUND)
def test_sound_signals(name, bits):
    x = in_bits(SOUND[name], bits) if bits else SOUND[name]
    assert [fault(x).samples for fault in (clipped_runs, spike_runs, drop_out_runs)] == [0, 0, 0]


@pytest.mark.parametrize("share", [0.01, 0.1])
@pytest.mark.parametrize("sides", ["both", "above", "below"])
@pytest.mark.parametrize("name", LIVE)
def test_clipped_signals(name, sides, share):
    x = LIVE[name]
    most = np.quantile(np.abs(x), 1 - share)
    low, high = (-np.inf if sides == "above" else -most), (np.inf if sides == "below" else most)
    clipped = np.count_nonzero((x <= low) | (x >= high))
    runs = clipped_runs(np.clip(x, low, high))
    assert runs.samples == clipped
    assert runs.starts[0] == np.argmax((x <= low) | (x >= high))


@pytest.mark.parametrize("name", LIVE)
def test_spikes(name):
    x = LIVE[name].copy()
    x[5000], x[15_000:15_002], x[N - 1] = 40 * x.std(), -40 * x.std(), 40 * x.std()
    runs = spike_runs(x)
    assert (runs.starts.tolist(), runs.lengths.tolist()) == ([5000, 15_000, N - 1], [1, 2, 1])


@pytest.mark.parametrize("bits", [0, 16])
@pytest.mark.parametrize("name", LIVE)
def test_drop_outs(name, bits):
    x = in_bits(LIVE[name], bits) if bits else LIVE[name].copy()
    x[2000:2040] = 0
    x[9000:9100] = x[9000]
    runs = drop_out_runs(x)
    assert np.abs(runs.starts - [2000, 9000]).max() <= 1
    assert runs.samples >= 139


def test_runs():
    runs = runs_of(np.array([0, 1, 5, 7, 8, 9]))
    assert (runs.starts.tolist(), runs.lengths.tolist(), runs.samples) == ([0, 5, 7], [2, 1, 3], 6)
    assert runs_of(np.zeros(0, dtype=int)).samples == 0
