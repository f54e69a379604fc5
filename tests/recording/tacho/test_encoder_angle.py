"""Verification: counts, angles and speeds of a shaft of known angle give pulses at equal angles."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.recording import Channel, recorded_signature
from sigdb.recording.tacho.encoder_angle import angle_pulses, counted_pulses, speed_pulses

FS = 6400.0


def channel(samples, unit="", fs=FS):
    return Channel(name="tacho", samples=np.asarray(samples, float), sampling_rate=fs, unit=unit)


def assert_even(at, even, *, begin=None, error=0.3):
    """Pulses lie at equal angles, to within an error in deg."""
    turned = at.angle(even.times)
    start = turned[0] if begin is None else begin
    assert_allclose(turned, start + np.arange(len(turned)) / even.pulses_per_rev, atol=error / 360)
    assert len(turned) > 100 * even.pulses_per_rev


@pytest.mark.parametrize("per_rev", [1024, 360, 5000])
@pytest.mark.parametrize("wrap", [None, 65_536, 2**32, "revolution"])
@pytest.mark.parametrize("sign", [1, -1])
def test_counts_rise_fall_and_wrap(shaft, per_rev, wrap, sign):
    at = shaft("wandering")
    t = np.arange(0, 8, 1 / FS)
    counts = np.floor(sign * (at.angle(t) + 0.3) * per_rev)
    modulus = per_rev if wrap == "revolution" else wrap
    # A counter of 32 bits wraps only if it begins near its end.
    begin = 0 if wrap != 2**32 else modulus - 7 * per_rev if sign > 0 else 7 * per_rev
    counts = counts if modulus is None else np.mod(counts + begin, modulus)
    modulus = modulus if np.any(np.abs(np.diff(counts)) > per_rev / 2) else None
    even = counted_pulses(channel(counts), per_rev, "tacho")
    assert_even(at, even, error=2.0 if per_rev == 360 else 0.5)
    assert even.indexed == (wrap == "revolution")
    if even.indexed and sign > 0:
        assert at.angle(even.times[:1])[0] == pytest.approx(0.7, abs=2e-3)
    assert even.notes[0].values["wraps_at"] == (modulus or 0)


def test_counts_slower_than_the_rate(shaft):
    # 16 counts a revolution, 20 samples each: the count changes somewhere between two samples.
    at = shaft("wandering")
    counts = np.floor(at.angle(np.arange(0, 8, 1 / FS)) * 16)
    assert_even(at, counted_pulses(channel(counts), 16, "tacho"), error=1.2)


@pytest.mark.parametrize(("unit", "factor"), [("deg", 360), ("rad", 2 * np.pi), ("rev", 1), ("°", 360)])
@pytest.mark.parametrize("wrapped", ["", "from 0", "about 0"])
def test_angles_in_their_units(shaft, unit, factor, wrapped):
    at = shaft("wandering")
    turns = at.angle(np.arange(0, 8, 1 / FS)) + 0.3
    turns = {"": turns, "from 0": turns % 1, "about 0": (turns + 0.5) % 1 - 0.5}[wrapped]
    noise = 1e-4 * np.random.default_rng(0).normal(size=turns.size)
    even = angle_pulses(channel((turns + noise) * factor, unit), "tacho")
    assert_even(at, even, begin=0.7 if wrapped else None, error=0.3)
    assert even.indexed == bool(wrapped)


@pytest.mark.parametrize(
    ("unit", "factor"), [("rpm", 60), ("Hz", 1), ("rad/s", 2 * np.pi), ("1/min", 60), ("U/min", 60)]
)
@pytest.mark.parametrize("fs", [50.0, 6400.0])
def test_speeds_are_integrated(shaft, unit, factor, fs):
    at = shaft("run-up")
    speed = np.interp(np.arange(0, 8, 1 / fs), at.t, at.speed)
    even = speed_pulses(channel(speed * factor, unit, fs), "tacho")
    assert_even(at, even, begin=0.0, error=0.3)
    assert not even.indexed
    assert "0.1 %" in even.notes[0].text


@pytest.mark.parametrize(
    ("pulses", "samples", "unit", "message"),
    [
        (angle_pulses, np.arange(100.0), "", "its unit '' is none of an angle"),
        (angle_pulses, np.arange(100.0), "rpm", "its unit 'rpm' is none of an angle"),
        (angle_pulses, np.arange(100.0), "rev", "turns by 1 revolutions from sample to sample"),
        (angle_pulses, np.r_[np.arange(50.0), np.arange(50.0, 0, -1)], "deg", "stand still or turn back"),
        (angle_pulses, np.zeros(100), "deg", "stand still or turn back"),
        (speed_pulses, np.full(100, 1500.0), "V", "its unit 'V' is none of a speed"),
        (speed_pulses, np.r_[np.full(50, 1500.0), np.zeros(50)], "rpm", "its speed is 0 rpm at 0.007"),
        (speed_pulses, np.full(3, 1500.0), "rpm", "it has 3 values"),
    ],
)
def test_what_is_no_angle(pulses, samples, unit, message):
    with pytest.raises(InputError, match=message):
        pulses(channel(samples, unit), "tacho")


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (np.zeros(100), "counts stand still"),
        (np.arange(100) / 7, "no whole numbers"),
        (np.r_[np.arange(50.0), np.arange(50.0, 0, -1)], "stand still or turn back"),
        (np.arange(3000.0) * 10 % 7777, "neither a revolution of 1024 counts nor the range of a counter"),
    ],
)
def test_what_is_no_count(samples, message):
    with pytest.raises(InputError, match=message):
        counted_pulses(channel(samples), 1024, "tacho")


KINDS = {
    "counts": ({"pulses_per_rev": 1024.0}, lambda turns, speed: (np.floor(turns * 1024), "")),
    "angle": ({}, lambda turns, speed: (turns % 1 * 360, "deg")),
    "speed": ({}, lambda turns, speed: (speed * 60, "rpm")),
}


@pytest.mark.parametrize("kind", KINDS)
def test_signatures_by_each_kind(shaft, recorded, kind):
    at = shaft("wandering")
    options, make = KINDS[kind]
    t = np.arange(0, at.t[-1], 1 / FS)
    samples, unit = make(at.angle(t), np.interp(t, at.t, at.speed))
    found = recorded_signature(recorded(at, channel(samples, unit), tacho_kind=kind, **options), teeth=12)
    exact = recorded_signature(recorded(at, at.waveform(at.marks(), FS)), teeth=12)
    # Counts begin with the first that changes, two samples of the average later.
    turned = [np.max(np.abs(np.roll(found.tsa, turn) - exact.tsa)) for turn in range(4)]
    assert min(turned if kind == "counts" else turned[:1]) < 0.25
    assert found.averages in (158, 159)
    assert found.absolute == (kind == "angle")


def test_a_shaft_that_stops_is_refused(shaft, recorded):
    at = shaft("stop")
    counts = np.floor(at.angle(np.arange(0, at.t[-1], 1 / FS)) * 1024)
    with pytest.raises(InputError, match=r"^made: tacho tacho: .* (leaps|go on evenly) at [345]\.?\d* s"):
        recorded_signature(recorded(at, channel(counts), tacho_kind="counts", pulses_per_rev=1024.0), teeth=12)
