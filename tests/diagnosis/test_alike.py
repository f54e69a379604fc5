"""Two recordings of a pair: units, bands, channels and marks that differ are refused, mended or said."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sigdb.core import InputError, Note
from sigdb.diagnosis.alike import make_alike, notes_of
from sigdb.recording import MeshPresence, RecordedSignature

TEETH, N = 12, 768
THETA = 2 * np.pi * np.arange(N) / N


def average(teeth_errors=True):
    """Mesh harmonics and what errors of the teeth leave at the other orders: random phases."""
    stream = np.random.default_rng(3)
    X = np.zeros(N // 2 + 1, complex)
    X[[12, 24, 36]] = 300.0, 200.0j, 100.0
    X[1:60] += teeth_errors * 10 * np.exp(2j * np.pi * stream.uniform(size=59))
    return np.fft.irfft(X, N)


def signature(tsa, seed=0, **changes):
    noise = 0.01
    empty = pd.DataFrame()
    made = RecordedSignature(
        intervals=pd.DataFrame({"indicator": [], "low": [], "high": []}),
        envelope=None,
        shafts=pd.DataFrame(),
        order_map=None,
        source="run.csv", channel="a1", unit="m/s^2", gear="pinion", shaft="shaft", teeth=TEETH, angle="tacho",
        absolute=True, tsa=tsa + noise * np.random.default_rng(seed).standard_normal(N), scatter=0.1,
        noise=np.full(N // 2 + 1, noise), groups=np.zeros((0, N)), averages=100, dropped=0, cycle=None,
        speed_rpm=600.0, speed_track=empty,
        kept=1.0, presence=MeshPresence(present=True, reason="", p_value=0.0), highest_order=384.0,
        order_spectrum=empty, record_spectrum=empty, lines=empty, indicators={}, notes=(),
    )  # fmt: skip
    return replace(made, **changes)


HEALTHY = {"seed": 1, "source": "new.csv"}


def codes(pair):
    return [note.code for note in pair.notes]


@pytest.mark.parametrize(("unit", "other"), [("g", "m/s"), ("V", "g"), ("mm", "m/s^2"), ("V", "mV")])
def test_different_quantities_are_refused_by_name(unit, other):
    with pytest.raises(InputError, match=re.escape(f"differ in their unit: {other} in new.csv, {unit} in run.csv")):
        make_alike(signature(average(), unit=unit), signature(average(), unit=other, **HEALTHY))


@pytest.mark.parametrize(
    ("unit", "other", "factor"),
    [("m/s^2", "g", 9.80665), ("g", "m/s²", 1 / 9.80665), ("mm/s", "m/s", 1e3), ("in/s", "mm/s", 1 / 25.4)],
)
def test_units_of_one_quantity_are_converted_and_said(unit, other, factor):
    healthy = signature(average(), unit=other, **HEALTHY)
    pair = make_alike(signature(average(), unit=unit), healthy)
    np.testing.assert_allclose(pair.healthy.tsa, factor * healthy.tsa, rtol=1e-12)
    np.testing.assert_allclose(pair.healthy.noise, factor * healthy.noise, rtol=1e-12)
    assert (pair.healthy.unit, codes(pair)) == (unit, ["unit-converted"])


def test_a_missing_unit_is_taken_to_be_the_same_and_said():
    pair = make_alike(signature(average(), unit=""), signature(average(), **HEALTHY))
    assert codes(pair) == ["unit-assumed"]
    assert "no stated unit in run.csv" in pair.notes[0].text


def test_another_channel_and_another_band_are_said():
    low = average()
    pair = make_alike(signature(low), signature(low, channel="a2", highest_order=40.0, **HEALTHY))
    assert codes(pair) == ["channels-differ", "bands-differ"]
    assert pair.notes[1].values["compared"] == 36.0


def test_of_several_bands_only_the_narrowest_is_said():
    run = signature(average(), highest_order=60.0)
    pairs = [make_alike(run, signature(average(), highest_order=order, **HEALTHY)) for order in (80.0, 40.0, 48.0)]
    bands = [note for note in notes_of(pairs) if note.code == "bands-differ"]
    assert [note.values["healthy"] for note in bands] == [40.0]


def test_another_tooth_count_and_the_same_samples_are_refused():
    run = signature(average())
    with pytest.raises(InputError, match="differ in their tooth count"):
        make_alike(run, replace(run, teeth=24, source="new.csv"))
    with pytest.raises(InputError, match="hold the same samples"):
        make_alike(run, replace(run, source="new.csv"))


@pytest.mark.parametrize("teeth", [3.0, -5.0, 0.75, 4.4])
def test_marks_that_do_not_agree_make_teeth_relative(teeth):
    turned = np.fft.irfft(np.fft.rfft(average()) * np.exp(-2j * np.pi * np.arange(N // 2 + 1) * teeth / TEETH), N)
    pair = make_alike(signature(turned), signature(average(), **HEALTHY))
    assert codes(pair) == ["marks-disagree"]
    assert pair.notes[0].values["teeth"] == pytest.approx(teeth, abs=0.02)
    assert not pair.signature.absolute
    assert not pair.healthy.absolute


@pytest.mark.parametrize("change", ["nothing", "a tooth", "the gain"])
def test_marks_that_agree_stay_absolute(change):
    x = average()
    run = {
        "nothing": x,
        "a tooth": x + 3 * np.exp(-(((THETA - 3) * 4) ** 2)) * np.cos(30 * THETA),
        "the gain": 2 * x,
    }[change]
    pair = make_alike(signature(run), signature(x, **HEALTHY))
    assert (codes(pair), pair.signature.absolute) == ([], True)


def test_a_damaged_tooth_that_looks_like_an_error_of_another_leaves_the_marks():
    """The run has its greatest error at tooth 4, the healthy gear at tooth 9; the other teeth are the same."""

    def passes(heights):
        shape = np.exp(-0.5 * (((np.arange(N) / 64) % 1 - 0.5) / 0.2) ** 2)
        return 30 * np.repeat(heights, 64) * shape * np.cos(36 * THETA) + average(teeth_errors=False)

    heights = 0.03 * np.random.default_rng(8).standard_normal(TEETH)
    heights[8] = 0.3
    damaged = np.where(np.arange(TEETH) == 3, 1.0, heights)
    noise = np.random.default_rng(2).standard_normal((2, 12, N)) * 0.1
    run, new = (
        signature(passes(each) + more.mean(axis=0), groups=passes(each) + more, **names)
        for each, more, names in ((damaged, noise[0], {}), (heights, noise[1], HEALTHY))
    )
    assert codes(make_alike(run, new)) == []
    assert codes(make_alike(*(replace(each, groups=each.groups[:5]) for each in (run, new)))) == ["marks-disagree"]
    turned = replace(new, source="turned.csv", tsa=np.roll(new.tsa, 64), groups=np.roll(new.groups, 64, axis=1))
    assert codes(make_alike(turned, new)) == ["marks-disagree"]


@pytest.mark.parametrize("turn", [0, 3, 1.5])
def test_marks_that_nothing_shows_to_agree_are_a_doubt(turn):
    """Without errors of the teeth all teeth look alike, whichever passes at the mark: the numbers rest on the tacho."""
    x = average(teeth_errors=False)
    pair = make_alike(signature(np.roll(x, int(turn * N / TEETH))), signature(x, **HEALTHY))
    assert (codes(pair), pair.signature.absolute) == (["marks-unverified"], True)


@pytest.mark.parametrize(
    ("share", "other", "code"),
    [
        (0.6, 0.4, "marks-disagree"),
        (0.75, 0.25, "marks-disagree"),
        (0.25, 0.25, "marks-unverified"),
        (0.52, 0.48, "marks-unverified"),
        (0.1, 0.3, "marks-unverified"),
    ],
)
def test_pulses_of_opposite_polarity_make_teeth_relative_where_nothing_else_shows_it(share, other, code):
    x = average(teeth_errors=False)
    run, new = (
        signature(x, notes=(Note(code="tacho", text="", values={"pulse_share": each}),), **changes)
        for each, changes in ((share, {}), (other, HEALTHY))
    )
    assert codes(make_alike(run, new)) == [code]
    assert make_alike(run, new).signature.absolute == (code == "marks-unverified")


def test_what_is_left_above_the_range_is_no_agreement():
    """Above their range averages hold remains of the resampling alone, which do not turn with the mark."""
    remains = np.zeros(N // 2 + 1, complex)
    remains[210:] = 10.0
    x = average()
    noise = np.where(np.arange(N // 2 + 1) < 200, 0.01, 1e-9)
    turned = np.roll(x, 3 * N // TEETH)
    run, new = (
        signature(each + np.fft.irfft(remains, N), noise=noise, highest_order=200.0, **changes)
        for each, changes in ((turned, {}), (x, HEALTHY))
    )
    assert codes(make_alike(run, new)) == ["marks-disagree"]
