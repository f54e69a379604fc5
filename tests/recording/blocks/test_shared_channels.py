"""Channels that are averaged by one angle share its pulses, its speed and its resampling. Evidence: unit."""

from typing import Any

import numpy as np
import pytest

from sigdb.recording import Channel, RecordedAverages, Recording, SharedChannels, recorded_averages
from sigdb.recording import channel_record as channel_records
from sigdb.recording.blocks import shared_channels
from sigdb.signature import SynchronousAverager

FS, TEETH, SECONDS = 4000.0, 12, 8.0
NAMES = ("a1", "a2", "a3")


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Three channels of one mesh with sidebands, one of them of another length, and a tacho."""
    stream, t = np.random.default_rng(3), np.arange(int(FS * SECONDS)) / FS
    turns = 20 * t + 0.02 * np.sin(2 * np.pi * 0.3 * t)
    mesh = (1 + 0.3 * np.cos(2 * np.pi * turns)) * np.cos(2 * np.pi * TEETH * turns)
    samples = {name: mesh * (i + 1) + 0.1 * stream.normal(size=t.size) for i, name in enumerate(NAMES)}
    samples["a3"] = samples["a3"][:-500]
    samples["tacho"] = 5.0 * (turns % 1 < 0.1)
    channels = tuple(Channel(name=name, samples=x, sampling_rate=FS) for name, x in samples.items())
    return Recording(source="here", channels=channels, tacho="tacho")


def averaged(recording: Recording, name: str, shared: SharedChannels | None, **options: Any) -> RecordedAverages:
    """Return the averages of a channel."""
    return recorded_averages(recording, channel=name, teeth=TEETH, samples_per_tooth=16, shared=shared, **options)


@pytest.mark.parametrize(
    "options", [{}, {"mesh_phase": True, "speed_range_rpm": (1000.0, 1400.0)}], ids=["tacho", "mesh"]
)
def test_shared_work_changes_no_average(recording: Recording, options: dict[str, Any]) -> None:
    shared = SharedChannels(NAMES)
    for name in NAMES:
        together, alone = (averaged(recording, name, each, **options) for each in (shared, None))
        for field in ("tsa", "noise", "groups", "begin", "scatter"):
            np.testing.assert_allclose(getattr(together, field), getattr(alone, field), rtol=1e-9, atol=1e-12)
        assert together.notes == alone.notes
        assert together.presence.p_value == pytest.approx(alone.presence.p_value)


@pytest.mark.parametrize(
    ("function", "options", "calls"),
    [
        ("tacho_angle", {}, 2),  # one for two channels, one for that of another length
        ("mesh_speed", {"mesh_phase": True, "speed_range_rpm": (1000.0, 1400.0)}, 2),
    ],
)
def test_the_angle_is_found_once(
    recording: Recording, monkeypatch: pytest.MonkeyPatch, function: str, options: dict[str, Any], calls: int
) -> None:
    original, counted = getattr(channel_records, function), []

    def counting(*args: Any, **more: Any) -> Any:
        counted.append(args)
        return original(*args, **more)

    monkeypatch.setattr(channel_records, function, counting)
    shared = SharedChannels(NAMES)
    for name in NAMES:
        averaged(recording, name, shared, **options)
    assert len(counted) == calls


@pytest.mark.parametrize(("most", "shapes"), [(2**24, [(2,), (1,)]), (1, [(1,), (1,), (1,)])])
def test_channels_of_one_length_are_resampled_together(
    recording: Recording, monkeypatch: pytest.MonkeyPatch, most: int, shapes: list[tuple[int]]
) -> None:
    original, seen = SynchronousAverager.first_revolution, []

    def counting(averager: SynchronousAverager, x: Any, pulse_times: Any) -> Any:
        seen.append(x.shape[:-1])
        return original(averager, x, pulse_times)

    monkeypatch.setattr(SynchronousAverager, "first_revolution", counting)
    monkeypatch.setattr(shared_channels, "MOST_VALUES", most)
    shared = SharedChannels(NAMES)
    for name in NAMES:
        averaged(recording, name, shared)
    assert seen == shapes
