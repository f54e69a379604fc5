"""Verification: marks that are not evenly spaced are learnt, and pulses at equal angles are interpolated."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from sigdb.core import InputError
from sigdb.recording import recorded_signature
from sigdb.recording.tacho.pulse_train import pulse_train
from sigdb.recording.tacho.uneven_marks import even_pulses

WHEELS = {
    "60-2": (60, np.arange(58) / 60),
    "60-2 by its pulses": (58, np.arange(58) / 60),
    "36-1": (36, np.arange(35) / 36),
    "4-1": (4, np.arange(3) / 4),
    "two marks": (2, np.array([0, 0.25])),
    "two close marks": (2, np.array([0, 0.06])),
    "zebra tape": (60, np.arange(60) / 59.6),
    "twelve and an index": (13, np.sort(np.append(np.arange(12) / 12, 0.5 / 12))),
}
EIGHT = np.array([0, 0.138, 0.263, 0.372, 0.513, 0.654, 0.763, 0.883])


@pytest.mark.parametrize("motion", ["wandering", "run-up"])
@pytest.mark.parametrize(("each", "angles"), WHEELS.values(), ids=WHEELS.keys())
def test_pulses_lie_at_equal_angles(shaft, motion, each, angles):
    at = shaft(motion)
    even = even_pulses(pulse_train(at.marks(angles), each), pulses_per_rev=each, name="t")
    turned = at.angle(even.times)
    assert even.indexed
    assert even.pulses_per_rev == each
    assert_allclose(turned - turned[0], np.arange(len(turned)) / each, atol=0.2 / 360)
    assert [note.code for note in even.notes] == ["tacho-marks", "tacho-index"]


def test_the_index_is_behind_the_gap(shaft):
    at = shaft("wandering")
    for first in (0, 17, 40):
        # The record begins at another tooth each time; the tooth behind the gap is at 0.
        even = even_pulses(pulse_train(at.marks(np.arange(58) / 60)[first:], 60), pulses_per_rev=60, name="t")
        assert at.angle(even.times[:1])[0] == pytest.approx(round(at.angle(even.times[:1])[0]), abs=1e-4)


def test_eight_uneven_marks_are_learnt(shaft):
    at = shaft("wandering")
    even = even_pulses(pulse_train(at.marks(EIGHT), 8), pulses_per_rev=8, name="t")
    turned = at.angle(even.times)
    assert_allclose(turned - turned[0], np.arange(len(turned)) / 8, atol=0.05 / 360)
    (note,) = even.notes
    off = EIGHT - np.arange(8) / 8
    assert note.values["largest_deg"] == pytest.approx(np.ptp(off) / 2 * 360, rel=0.02)


@pytest.mark.parametrize("false", [[], [60.5], [400.3, 700.7]])
def test_the_average_is_that_of_exact_marks(shaft, recorded, false):
    at, fs = shaft("wandering"), 12_800.0
    marks = at.marks(EIGHT)
    times = np.sort(np.append(marks, np.interp(false, np.arange(marks.size), marks))) if false else marks
    found = recorded_signature(
        recorded(at, at.waveform(times, fs, width=6 / fs), fs, pulses_per_rev=8), teeth=12, revolutions=150
    )
    exact = recorded_signature(recorded(at, at.waveform(at.marks(), fs), fs), teeth=12, revolutions=150)
    # The waveform begins with its pulse half risen: the first that is found is the mark behind.
    begin = round((found.tsa.size) * EIGHT[1])
    best = min(np.max(np.abs(np.roll(found.tsa, turn) - exact.tsa)) for turn in range(begin - 3, begin + 4))
    assert best < 0.12  # between samples of the average the two lie up to half a sample apart
    assert found.indicators["fm4"] == pytest.approx(exact.indicators["fm4"], rel=0.01)
    assert not found.absolute


def test_torsion_is_not_taken_for_marks(shaft):
    for each, angles in ((60, np.arange(60) / 60), (60, np.arange(58) / 60)):
        times = shaft("torsion").marks(angles)
        even = even_pulses(pulse_train(times, each), pulses_per_rev=each, name="t")
        assert_allclose(shaft("torsion").angle(even.times) * each % 1 % 1, 0, atol=1e-2) if each == 58 else None
        assert np.isin(times[:58], even.times).sum() >= 50 or each == 60


def test_what_does_not_repeat_or_is_short_is_refused(shaft):
    with pytest.raises(InputError, match="3 whole revolutions are too few to learn their spacing, which needs 8"):
        even_pulses(pulse_train(shaft("wandering").marks(EIGHT)[:30], 8), pulses_per_rev=8, name="t")
