"""Unit: speeds, ratios and rates that do not fit the rig, the stated speed or the teeth."""

import numpy as np
import pytest

import sigdb
from sigdb.core import InputError
from sigdb.recording import recorded_signature

FS = 12_800.0


def notes(signature):
    return {note.code: note for note in signature.notes}


@pytest.fixture
def by_rig(shaft, recorded):
    """A signature of the test rig's pinion (19 and 48 teeth, 1800 rpm) from a shaft at 1200 or 1800 rpm."""
    rig = sigdb.load_transmission("spur-test-rig")

    def compute(motion="steady", speed=30.0, marks=1, gear="pinion", **options):
        at = shaft(motion)
        at = type(at)(at.t, at.speed * speed / 20)
        waveform = at.waveform(at.marks(np.arange(marks) / marks), FS, width=0.3 / marks / 30)
        return recorded_signature(recorded(at, waveform, FS, **options), rig=rig, gear=gear)

    return compute


def test_a_speed_that_cannot_be_is_noted_with_what_fits(by_rig):
    slow = notes(by_rig(pulses_per_rev=60))["speed-unlike-rig"]
    assert slow.values["speed_rpm"] == pytest.approx(30, rel=1e-3)
    assert slow.values["expected_rpm"] == 1800
    assert "pulses_per_rev = 1 would fit" in slow.text
    assert "speed-unlike-rig" not in notes(by_rig())
    assert "speed-unlike-rig" not in notes(by_rig(speed=32.0))
    wheel = notes(by_rig(gear="wheel"))["speed-unlike-rig"]
    assert "ratio = 19/48, the tacho on" in wheel.text


def test_many_pulses_read_as_one_are_named(by_rig):
    with pytest.raises(
        InputError, match=r"the mesh of 19 teeth at 4\.32e\+04 rpm is at 1\.368e\+04 Hz, not below half"
    ):
        by_rig(marks=24)
    assert "pulses_per_rev = 4 would fit" in notes(by_rig(marks=4))["speed-unlike-rig"].text


def test_a_stated_speed_counts_like_a_rig(shaft, recorded):
    at = shaft("steady")
    recording = recorded(at, at.waveform(at.marks(), FS), FS, speed_rpm=2400.0)
    note = notes(recorded_signature(recording, teeth=12))["speed-unlike-rig"]
    assert "the tacho gives 1200.0 rpm, the stated speed is 2400.0 rpm" in note.text
    assert "speed-unlike-rig" not in notes(recorded_signature(recording, teeth=12, speed_rpm=1250.0))


def test_a_rounded_ratio_is_refused_with_the_exact_one(by_rig):
    with pytest.raises(
        InputError, match=r"ratio = 0\.396 is near 19/48 = 0\.39583333 .* slips by .* give ratio '19/48'"
    ):
        by_rig(gear="wheel", ratio=0.396)
    exact = by_rig(gear="wheel", ratio=19 / 48)
    assert {"ratio-unlike-rig", "speed-unlike-rig"}.isdisjoint(notes(exact))
    assert "is that of no shaft of the rig" in notes(by_rig(gear="wheel", ratio=0.5))["ratio-unlike-rig"].text


@pytest.mark.parametrize(
    ("ratio", "doubt"), [(0.396, True), (0.667, True), (19 / 48, False), (0.375, False), (3.0, False)]
)
def test_a_ratio_that_looks_rounded_is_noted_without_a_rig(shaft, recorded, ratio, doubt):
    at = shaft("steady")
    signature = recorded_signature(recorded(at, at.waveform(at.marks(), FS), FS, ratio=ratio), teeth=12)
    assert ("rounded-ratio" in notes(signature)) == doubt


def test_a_mesh_or_a_rate_that_cannot_be_is_refused(shaft, recorded):
    at = shaft("steady")
    for fs, message in (
        (400.0, r"12 teeth at 1200 rpm is at 240 Hz, not below half .* 200 Hz"),
        (90.0, "at least 100 Hz"),
    ):
        recording = recorded(at, at.waveform(at.marks(), fs, width=0.02 if fs > 100 else 0.03), fs)
        with pytest.raises(InputError, match=message):
            recorded_signature(recording, teeth=12)


def test_a_coarse_tacho_is_noted(shaft, recorded):
    at = shaft("steady")
    stream = np.random.default_rng(0)
    for jitter, noted in ((0.0, False), (0.0005, True)):
        times = at.marks() + jitter * stream.normal(size=at.marks().size)
        signature = recorded_signature(recorded(at, at.waveform(times, FS), FS), teeth=48)
        assert ("tacho-coarse" in notes(signature)) == noted
