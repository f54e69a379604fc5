"""Verification: signatures by tachos with faults are those by the clean tacho; what is doubtful is noted."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.recording import Channel, Recording, recorded_signature

FS = 6400.0


@pytest.fixture
def clean(shaft, recorded):
    at = shaft("wandering")
    return at, recorded_signature(recorded(at, at.waveform(at.marks(), FS)), teeth=12)


def notes(signature):
    return {note.code: note for note in signature.notes}


def test_a_stretch_of_double_pulses_changes_nothing(clean, recorded):
    at, wanted = clean
    marks = at.marks()
    twice = np.sort(np.append(marks, np.interp(np.arange(60, 80) + 0.5, np.arange(marks.size), marks)))
    found = recorded_signature(recorded(at, at.waveform(twice, FS)), teeth=12)
    assert_allclose(found.tsa, wanted.tsa, atol=1e-9)
    assert found.averages == wanted.averages == 158
    assert found.speed_track["speed_rpm"].between(1180, 1220).all()
    note = notes(found)["tacho-mended"]
    assert note.values["dropped"] == 20
    assert (note.values["first_s"], note.values["last_s"]) == (
        pytest.approx(twice[61], abs=1e-3), pytest.approx(twice[99], abs=1e-3)
    )  # fmt: skip


def test_a_drift_and_a_spike_change_little_and_are_noted(clean, recorded):
    at, wanted = clean
    x = at.waveform(at.marks(), FS)
    drift = recorded_signature(recorded(at, x + 1.6 * np.arange(x.size) / x.size), teeth=12)
    x[20_050] = 13.0
    spike = recorded_signature(recorded(at, x), teeth=12)
    for found, code in ((drift, "tacho-levels"), (spike, "tacho-spike")):
        assert found.averages == wanted.averages
        assert found.indicators["fm4"] == pytest.approx(wanted.indicators["fm4"], rel=0.02)
        assert code in notes(found)
    assert notes(spike)["tacho-spike"].values["first_s"] == pytest.approx(20_050 / FS)


def test_an_inverted_tacho_gives_the_same_teeth(clean, recorded):
    at, wanted = clean
    found = recorded_signature(recorded(at, 5 - 5 * at.waveform(at.marks(), FS)), teeth=12)
    assert_allclose(found.tsa, wanted.tsa, atol=1e-6)
    assert notes(found)["tacho-edge"].values["edge"] == "falling"
    trailing = recorded_signature(recorded(at, 5 - 5 * at.waveform(at.marks(), FS), edge="rising"), teeth=12)
    assert np.max(np.abs(trailing.tsa - wanted.tsa)) > 0.5


def test_pulses_in_a_part_of_the_record_are_noted_or_refused(clean, recorded):
    at, wanted = clean
    for part, stays in ((at.marks() < 6, True), (at.marks() > 3, True), (at.marks() < 2, False)):
        recording = recorded(at, at.waveform(at.marks()[part], FS))
        if not stays:
            with pytest.raises(InputError, match=r"pulses cover 1\.9\d* s of 8 s of the signal, from 0\.0\d* to 1\.9"):
                recorded_signature(recording, teeth=12)
            continue
        found = recorded_signature(recording, teeth=12)
        note = notes(found)["tacho-coverage"]
        times = at.marks()[part][1:] if part[0] else at.marks()[part]
        assert note.values["first_s"] == pytest.approx(times[0], abs=1e-3)
        assert note.values["last_s"] == pytest.approx(times[-1], abs=1e-3)
    assert "tacho-coverage" not in notes(wanted)


def test_a_gap_in_the_middle_is_refused(clean, recorded):
    at, _ = clean
    marks = at.marks()
    with pytest.raises(InputError, match=r"^made: tacho tacho: its pulses do not go on evenly at (3\.9|4|4\.\d+) s"):
        recorded_signature(recorded(at, at.waveform(marks[(marks < 4) | (marks > 5)], FS)), teeth=12)


@pytest.mark.parametrize("late", [0.0123, -0.0123])
def test_a_tacho_that_begins_at_another_time_is_shifted(clean, late):
    at, wanted = clean
    signal = Channel(name="a1", samples=at.vibration(FS), sampling_rate=FS)
    # The tacho's channel has its own rate and begins late or early.
    fs = 5000.0
    t = late + np.arange(39_000) / fs
    marks = at.marks()[1:-1]
    samples = np.interp(t, (marks[:, None] + [-1e-3, 1e-3, 4e-3, 5e-3]).ravel(), np.tile([0.0, 1, 1, 0], marks.size))
    tacho = Channel(name="tacho", samples=samples, sampling_rate=fs, start=late)
    found = recorded_signature(Recording(source="made", channels=(signal, tacho), tacho="tacho"), teeth=12)
    shared = min(found.averages, wanted.averages)
    assert shared >= 150
    assert_allclose(found.tsa, wanted.tsa, atol=0.01)


def test_times_of_pulses_take_the_place_of_a_waveform(clean, recorded):
    at, wanted = clean
    marks = at.marks()[1:-1]
    signal = Channel(name="a1", samples=at.vibration(FS), sampling_rate=FS)
    by_field = Recording(source="made", channels=(signal,), pulse_times=marks)
    in_ms = Channel(name="tacho", samples=1000 * marks, sampling_rate=FS, unit="ms")
    by_channel = Recording(source="made", channels=(signal, in_ms), tacho="tacho", tacho_kind="pulse-times")
    for recording in (by_field, by_channel):
        found = recorded_signature(recording, teeth=12)
        assert_allclose(found.tsa, wanted.tsa, atol=1e-3)
        assert found.absolute
    with pytest.raises(InputError, match=r"pulses lie at 49\.\d* to 79\d\d\.\d* s of a record of 8 s; give times in s"):
        recorded_signature(replace(by_field, pulse_times=1000 * marks), teeth=12)
    with pytest.raises(InputError, match=r"pulse 4 at 0\.1\d* s is not after the one before"):
        recorded_signature(replace(by_field, pulse_times=marks[[0, 1, 3, 2, 4, 5]]), teeth=12)
    volts = replace(by_channel, channels=(signal, replace(in_ms, unit="V")))
    with pytest.raises(InputError, match="its unit 'V' is none of time"):
        recorded_signature(volts, teeth=12)


def test_a_missing_tooth_is_an_absolute_mark(clean, recorded):
    at, _ = clean
    fs = 25_600.0
    exact = recorded_signature(recorded(at, at.waveform(at.marks(), fs), fs), teeth=12)
    wheel = at.marks(np.arange(58) / 60)
    for begin in (0, 20):
        found = recorded_signature(
            recorded(at, at.waveform(wheel[begin:], fs, width=8 / fs), fs, pulses_per_rev=60), teeth=12
        )
        assert found.absolute
        assert_allclose(found.tsa, exact.tsa, atol=0.02)
