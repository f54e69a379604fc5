"""Verification: a signature in blocks is that of the whole recording, and its memory does not grow with the file."""

import tracemalloc

import h5py
import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.recording import Channel, Recording, read_in_blocks, read_recording, recorded_signature
from sigdb.recording.tacho.waveform import Waveform
from sigdb.recording.tacho.waveform_pulses import waveform_pulses

FS, TEETH = 4000.0, 12
OPTIONS = {"names": ("a1", "tacho"), "tacho": "tacho", "units": {"a1": "g", "tacho": "V"}, "sampling_rate": FS}


def _signal(size, begin=0):
    """A shaft of about 20 rev/s with a gear of 12 teeth, and its tacho."""
    t = np.arange(begin, begin + size) / FS
    rev = 20 * t + 0.3 * np.sin(2 * np.pi * 0.4 * t)
    noise = np.random.default_rng(begin).normal(size=(2, size))
    a1 = np.cos(2 * np.pi * TEETH * rev) + 0.3 * np.cos(2 * np.pi * (TEETH + 1) * rev) + 0.2 * noise[0]
    return np.column_stack([a1, 5.0 * (rev % 1 < 0.1) + 0.02 * noise[1]])


def _edges(x):
    """Pulses that begin at multiples of 1000 samples, so at the edges of blocks."""
    tacho = 5.0 * (np.arange(len(x)) % 200 < 20)
    return np.column_stack([np.cos(2 * np.pi * TEETH * np.arange(len(x)) / 200) + x[:, 0] / 9, tacho])


CHANGES = {
    "plain": lambda x: x,
    "at edges": _edges,
    "drift": lambda x: x + np.outer(np.arange(len(x)) / len(x), [0, 20]),
    "upside down": lambda x: x * [1, -1],
    "a spike": lambda x: x + np.outer(np.arange(len(x)) == 7777, [0, 90]),
    "a lost pulse": lambda x: x * np.column_stack(
        [np.ones(len(x)), ~((np.arange(len(x)) > 8100) & (np.arange(len(x)) < 8280))]
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "samples"),
    [(name, 4096) for name in CHANGES] + [("at edges", 1000), ("plain", 3001)],
)
def test_a_signature_in_blocks_is_that_of_the_whole_recording(tmp_path, change, samples):
    path = tmp_path / "run.npy"
    np.save(path, CHANGES[change](_signal(20_011)))
    whole = recorded_signature(read_recording(path, **OPTIONS), teeth=TEETH)
    blocks = recorded_signature(read_in_blocks(path, samples=samples, **OPTIONS), teeth=TEETH)
    assert (blocks.averages, blocks.dropped, blocks.unit) == (whole.averages, whole.dropped, "g")
    assert_allclose(blocks.tsa, whole.tsa, atol=1e-9)
    single = np.finfo(np.float32).eps * whole.tsa.std()  # the precision of the spectrum that shows the noise
    assert_allclose(blocks.noise, whole.noise, rtol=1e-6, atol=single)
    assert_allclose([blocks.scatter, blocks.kept, blocks.speed_rpm], [whole.scatter, whole.kept, whole.speed_rpm])
    assert_allclose(blocks.record_spectrum, whole.record_spectrum, atol=1e-9)
    assert_allclose(blocks.speed_track, whole.speed_track, rtol=1e-9)
    assert blocks.lines["name"].tolist() == whole.lines["name"].tolist()
    assert_allclose(list(blocks.indicators.values()), list(whole.indicators.values()), rtol=1e-6)
    notes = [note.text for note in whole.notes if note.code.startswith("tacho")]
    assert [note.text for note in blocks.notes if note.code.startswith("tacho")] == notes


@pytest.mark.parametrize("options", [{"threshold": 2.0}, {"hysteresis": 1.0}, {"edge": "falling"}, {}])
@pytest.mark.parametrize("change", CHANGES)
def test_pulses_in_blocks_are_those_of_the_whole_waveform(change, options):
    x = CHANGES[change](_signal(20_011))[:, 1].copy()
    in_blocks = Waveform(lambda: np.split(x, [1, 999, 5000, 5003, 17_001]), len(x), float(x.min()), float(x.max()))
    expected = waveform_pulses(x, FS, pulses_per_rev=1, **options)
    found = waveform_pulses(in_blocks, FS, pulses_per_rev=1, **options)
    assert_allclose(found.times, expected.times, atol=1e-5 / FS)
    assert (found.edge, found.local, len(found.spikes)) == (expected.edge, expected.local, len(expected.spikes))


@pytest.mark.parametrize("change", ["plain", "a spike"])
def test_percentiles_in_blocks_are_those_of_all_samples(change):
    x = CHANGES[change](_signal(20_011))[:, 1].copy()
    blocks = Waveform(lambda: np.split(x, [1, 999, 5000]), len(x), float(x.min()), float(x.max()))
    assert_allclose(blocks.percentiles(0, 0.5, 50, 97.3, 100), np.percentile(x, [0, 0.5, 50, 97.3, 100]), atol=1e-9)
    digital = np.round(x.clip(0, 5) / 5)
    blocks = Waveform(lambda: np.split(digital, 4321 * np.arange(1, 4)), len(x), 0.0, 1.0)
    assert blocks.percentiles(0.5, 99.5) == (0.0, 1.0)


def test_the_noise_of_a_long_average_counts_all_of_its_revolutions(tmp_path, monkeypatch):
    np.save(tmp_path / "run.npy", _signal(20_011))
    recording = read_recording(tmp_path / "run.npy", **OPTIONS)
    whole = recorded_signature(recording, teeth=TEETH)
    monkeypatch.setattr("sigdb.recording.blocks.averaged_record.MOST_OVER_ANGLE", 50)
    blocks = read_in_blocks(tmp_path / "run.npy", samples=3000, **OPTIONS)
    part = recorded_signature(blocks, teeth=TEETH)
    assert part.averages == whole.averages == 99
    # The level of the noise is estimated from half of the revolutions: within a tenth.
    middle = slice(20, 100)
    assert_allclose(np.median(part.noise[middle]), np.median(whole.noise[middle]), rtol=0.1)


def test_memory_does_not_grow_with_the_file(tmp_path, monkeypatch):
    path, size, block = tmp_path / "run.npy", 600_000, 2**14
    stored = np.lib.format.open_memmap(path, "w+", "<f8", (size, 2))
    for begin in range(0, size, 100_000):
        stored[begin : begin + 100_000] = _signal(100_000, begin)
    stored.flush()
    del stored
    monkeypatch.setattr("sigdb.recording.files.formats.contents.MAX_BYTES", 10**6)
    monkeypatch.setattr("sigdb.recording.blocks.averaged_record.MOST_OVER_ANGLE", 50)
    with pytest.raises(InputError, match="in blocks"):
        read_recording(path, **OPTIONS)
    np.save(tmp_path / "short.npy", _signal(10_000))
    recorded_signature(read_in_blocks(tmp_path / "short.npy", **OPTIONS), teeth=TEETH)  # modules are loaded
    tracemalloc.start()
    try:
        signature = recorded_signature(read_in_blocks(path, samples=block, threshold=2.5, **OPTIONS), teeth=TEETH)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert signature.averages == 2998
    assert peak < path.stat().st_size / 2, peak


def _as_kind(kind):
    """The recording with a tacho of another kind: the angle of the shaft as counts, as an angle or as a speed."""
    t = np.arange(9000) / FS
    rev = 20 * t + 0.3 * np.sin(2 * np.pi * 0.4 * t)
    speed = 60 * (20 + 0.3 * 2 * np.pi * 0.4 * np.cos(2 * np.pi * 0.4 * t))
    tacho = {"counts": np.floor(rev * 64), "angle": 360 * (rev % 1), "speed": speed}[kind]
    unit = {"counts": "", "angle": "deg", "speed": "rpm"}[kind]
    options = {"tacho_kind": kind, "units": {"a1": "g", "tacho": unit}, "pulses_per_rev": 64 if kind == "counts" else 1}
    return np.column_stack([_signal(9000)[:, 0], tacho]), OPTIONS | options


@pytest.mark.parametrize("kind", ["counts", "angle", "speed", "mesh phase"])
def test_what_needs_all_samples_at_once_takes_those_channels_into_memory(tmp_path, monkeypatch, kind):
    by_mesh = kind == "mesh phase"
    x, options = (_signal(9000), OPTIONS) if by_mesh else _as_kind(kind)
    averaging = {"teeth": TEETH, "mesh_phase": by_mesh} | ({"speed_rpm": 1200.0} if by_mesh else {})
    np.save(tmp_path / "run.npy", x)
    blocks = read_in_blocks(tmp_path / "run.npy", samples=1000, **options)
    signature = recorded_signature(blocks, **averaging)
    whole = recorded_signature(read_recording(tmp_path / "run.npy", **options), **averaging)
    assert signature.averages == whole.averages
    assert_allclose(signature.tsa, whole.tsa, atol=1e-9)
    assert_allclose(list(signature.indicators.values()), list(whole.indicators.values()), rtol=1e-6)
    assert "spoilt" not in {note.code for note in signature.notes}
    monkeypatch.setattr("sigdb.recording.blocks.recording_blocks.MAX_VALUES", 8000)
    names = "a1, tacho" if by_mesh else "tacho"
    with pytest.raises(InputError, match=f"all samples of {names} are needed at once.*more than 8000; cut"):
        recorded_signature(blocks, **averaging)


@pytest.mark.parametrize("name", ["run.h5", "run.csv"])
def test_pulse_times_are_read_with_the_blocks(tmp_path, name):
    """Pulse times in ms: an array of their own, or a column of a table that ends before the others."""
    x = np.round(_signal(9000)[:, 0], 9)
    t = np.arange(9000) / FS
    rev = 20 * t + 0.3 * np.sin(2 * np.pi * 0.4 * t)
    pulses = 1000 * np.round(np.interp(np.arange(8 * int(rev[-1])) / 8, rev, t), 9)
    if name == "run.h5":
        with h5py.File(tmp_path / name, "w") as file:
            file["a1"], file["pulses"] = x, pulses
    else:
        padded = np.append(pulses, np.full(9000 - len(pulses), np.nan))
        pd.DataFrame({"a1": x, "pulses": padded}).to_csv(tmp_path / name, index=False)
    options = {
        "tacho": "pulses", "tacho_kind": "pulse-times", "pulses_per_rev": 8, "sampling_rate": FS,
        "units": {"pulses": "ms", "a1": "g"},
    }  # fmt: skip
    for more in ({}, {"channels": ["a1"]}):
        whole = read_recording(tmp_path / name, **options, **more)
        blocks = read_in_blocks(tmp_path / name, samples=300, **options, **more)
        assert [channel.name for channel in blocks.channels] == ["a1"]
        assert_allclose(blocks.whole.pulse_times, whole.pulse_times, rtol=1e-12)
    assert_allclose(blocks.whole.pulse_times, pulses / 1000, atol=1e-9)
    signature = recorded_signature(blocks, teeth=TEETH)
    assert_allclose(signature.tsa, recorded_signature(whole, teeth=TEETH).tsa, atol=1e-9)


def test_pulse_times_that_are_missing_between_others_are_refused(tmp_path):
    pulses = np.arange(9000) / 500
    pulses[2000:4000] = np.nan
    table = pd.DataFrame({"a1": _signal(9000)[:, 0], "pulses": pulses})
    table.to_csv(tmp_path / "run.csv", index=False)
    options = {"tacho": "pulses", "tacho_kind": "pulse-times", "sampling_rate": FS, "units": {"pulses": "s"}}
    with pytest.raises(InputError, match=r"pulse times or more that rise, none of them missing"):
        read_in_blocks(tmp_path / "run.csv", samples=500, **options)


def test_signatures_in_blocks_that_cannot_be_are_refused_with_the_remedy(tmp_path):
    np.save(tmp_path / "run.npy", _signal(5000))
    blocks = read_in_blocks(tmp_path / "run.npy", samples=1000, **OPTIONS)
    with pytest.raises(InputError, match=r"revolutions = 99 must be at most 2\d"):
        recorded_signature(blocks, teeth=TEETH, revolutions=99)
    no_tacho = read_in_blocks(tmp_path / "run.npy", samples=1000, **OPTIONS | {"tacho": None})
    with pytest.raises(InputError, match="no channel is known as its tacho"):
        recorded_signature(no_tacho, teeth=TEETH)


def test_a_recording_in_memory_keeps_its_deviation():
    t = np.arange(20_000) / FS
    x = 3 + np.sqrt(2) * np.sin(2 * np.pi * 240 * t) + np.sqrt(2) * np.sin(2 * np.pi * 33.3 * t)
    tacho = Channel(name="tacho", samples=5.0 * (20 * t % 1 < 0.1), sampling_rate=FS)
    recording = Recording(source="", channels=(Channel(name="a", samples=x, sampling_rate=FS), tacho), tacho="tacho")
    assert recorded_signature(recording, teeth=TEETH).kept == pytest.approx(np.sqrt(0.5), rel=0.01)
