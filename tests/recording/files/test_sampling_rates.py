"""Unit: columns of times, sampling rates, and missing samples."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.missing_samples import fill_gaps
from sigdb.recording.files.time_base import time_base
from sigdb.recording.files.time_columns import rises_evenly

T = 3.25 + np.arange(2000) / 12_800
X = np.random.default_rng(5).normal(size=2000)


def table(path, t, x, header="t,x"):
    lines = [",".join("" if np.isnan(one) else repr(float(one)) for one in row) for row in zip(t, x, strict=True)]
    path.write_text("\n".join([*([header] if header else []), *lines]) + "\n", encoding="utf-8")
    return path


def texts(recording):
    return [note.text for note in recording.notes]


@pytest.mark.parametrize(("unit", "factor"), [("", 1), ("s", 1), ("ms", 1e3), ("us", 1e6), ("min", 1 / 60)])
def test_the_rate_is_the_slope(unit, factor):
    base = time_base(T * factor, name="t", unit=unit)
    assert_allclose(base.sampling_rate, 12_800, rtol=1e-9)
    assert base.jitter < 1e-6


def test_the_rate_of_jittered_times_is_that_of_the_clock():
    """The variance of a least-squares slope is 12 s^2 / n^3: here 6e-7 of a step, of which five are allowed."""
    u = np.random.default_rng(1).uniform(-0.3, 0.3, T.size)
    base = time_base(T + u / 12_800, name="t")
    deviation = 0.3 / np.sqrt(3) * np.sqrt(12 / T.size**3)
    assert abs(base.sampling_rate / 12_800 - 1) < 5 * deviation
    assert 0.29 < base.jitter < 0.31


@pytest.mark.parametrize("digits", [5, 6, 7])
def test_times_with_few_digits_are_even(digits):
    base = time_base(np.round(T, digits), name="t")
    assert_allclose(base.sampling_rate, 12_800, rtol=1e-5)
    assert base.jitter <= 0.5 * 10.0**-digits * 12_800 * 1.05


@pytest.mark.parametrize(
    ("t", "told"),
    [
        (np.delete(T, 700), r"leaps by 2 steps after sample 700: samples are missing there; cut the recording in two"),
        (np.delete(T, slice(700, 760)), "leaps by 61 steps after sample 700"),
        (np.concatenate([T[:50], T[:50]]), "must rise, and does not after sample 50"),
        (T[::-1], "must rise"),
        (np.zeros(50), "must rise"),
        (T + (T - T[0]) ** 2, "away from even times"),
        (T[:2], "three times or more"),
        (np.where(np.arange(2000) == 9, np.nan, T), "none of them missing"),
    ],
)
def test_times_that_are_not_even_are_refused(t, told):
    with pytest.raises(InputError, match=told):
        time_base(t, name="t")


def test_a_unit_that_is_none_of_time():
    with pytest.raises(InputError, match="column t has the unit 'deg', not one of time"):
        time_base(T, name="t", unit="deg")


def test_what_rises_evenly():
    assert rises_evenly(T)
    assert rises_evenly(np.round(T, 6))
    assert not rises_evenly(X)
    assert not rises_evenly(np.cumsum(np.abs(X)))
    assert not rises_evenly(T[:10])


@pytest.mark.parametrize("header", ["t,x", "Time [s],x", "time_s,x", "Zeit (s),x", None])
def test_a_column_of_times_is_found(tmp_path, header):
    read = read_recording(table(tmp_path / "run.csv", T, X, header))
    assert_allclose(read.channels[0].sampling_rate, 12_800, rtol=1e-9)
    assert_array_equal(read.channels[0].samples, X)
    assert len(read.channels) == 1
    assert any("12800 Hz from column" in note for note in texts(read))


def test_a_named_column_of_times(tmp_path):
    path = table(tmp_path / "run.csv", T, X, "clock,x")
    assert_allclose(read_recording(path, time="clock").channels[0].sampling_rate, 12_800, rtol=1e-9)
    read = read_recording(path, sampling_rate=12_800)
    assert [one.name for one in read.channels] == ["x"]
    assert "clock only rises, as times, counts and angles do, and was left out" in texts(read)
    with pytest.raises(InputError, match=r"give sampling_rate, in Hz, .* \(time\) \(clock only rises"):
        read_recording(path)


def test_time_may_be_no_time(tmp_path):
    read = read_recording(table(tmp_path / "run.csv", T, X), time=False, sampling_rate=100)
    assert [one.name for one in read.channels] == ["x"]
    assert read.channels[0].sampling_rate == 100


def three(path, header, *columns):
    rows = "".join(",".join(f"{value:.12g}" for value in row) + "\n" for row in zip(*columns, strict=True))
    path.write_text(f"{header}\n{rows}", encoding="utf-8")
    return path


def test_two_columns_of_times_that_agree(tmp_path):
    read = read_recording(three(tmp_path / "run.csv", "t,time_ms,x", T, 1e3 * T, X))
    assert_allclose(read.channels[0].sampling_rate, 12_800, rtol=1e-6)
    assert [one.name for one in read.channels] == ["x"]
    assert "time_ms is another column of times and was left out" in texts(read)


def test_two_columns_of_times_that_disagree(tmp_path):
    path = three(tmp_path / "run.csv", "t,time_s,x", T, 2 * T, X)
    told = "both t and time_s may hold the time, and they disagree: 12800 and 6400 Hz; give time='t'"
    with pytest.raises(InputError, match=told):
        read_recording(path)
    assert_allclose(read_recording(path, time="time_s").channels[0].sampling_rate, 6400, rtol=1e-6)


def test_a_count_of_samples_is_no_time(tmp_path):
    path = table(tmp_path / "run.csv", np.arange(2000.0), X, None)
    with pytest.raises(InputError, match="does not state the sampling rate"):
        read_recording(path)
    read = read_recording(path, sampling_rate=12_800)
    assert len(read.channels) == 1
    assert "column1 counts samples and was left out" in texts(read)


def test_jitter_is_told(tmp_path):
    t = T + np.random.default_rng(1).uniform(-0.2, 0.2, T.size) / 12_800
    read = read_recording(table(tmp_path / "run.csv", t, X))
    assert "column t is up to 0.2 steps away from even times, which were taken" in texts(read)


def test_a_given_rate_wins_and_the_other_is_told(tmp_path):
    read = read_recording(table(tmp_path / "run.csv", T, X), sampling_rate=10_000)
    assert read.channels[0].sampling_rate == 10_000
    assert "the file states 12800 Hz; the given 10000 Hz was taken" in texts(read)


def test_missing_samples_are_refused_with_a_given_rate_too(tmp_path):
    path = table(tmp_path / "run.csv", np.delete(T, 700), np.delete(X, 700))
    with pytest.raises(InputError, match="samples are missing there"):
        read_recording(path, sampling_rate=12_800)


def test_short_gaps_are_filled_by_straight_lines():
    x = 3.0 - 0.5 * np.arange(1000)
    holed = x.copy()
    holed[[4, 5, 6, 500]] = np.nan
    y, (note,) = fill_gaps(holed, name="x", longest=3)
    assert_allclose(y, x, rtol=0, atol=1e-12)
    assert note.text == "x: 4 missing samples in 2 gaps, the longest of 3, were filled by straight lines"
    assert (note.code, note.values["samples"], note.values["gaps"]) == ("filled-gaps", 4, 2)
    assert np.isnan(holed).sum() == 4


@pytest.mark.parametrize(
    ("missing", "options", "told"),
    [
        (slice(40, 46), {}, r"x: 6 samples are missing from sample 40 on; .* longest_gap \(now 5\)"),
        (
            slice(40, 41),
            {"is_tacho": True},
            "the tacho x: 1 samples are missing from sample 40 on, which may hide a pulse",
        ),
        (slice(10, 1000, 50), {}, "20 of 1000 samples are missing; more than 1 % is not filled"),
    ],
)
def test_other_gaps_are_refused(missing, options, told):
    x = np.zeros(1000)
    x[missing] = np.nan
    with pytest.raises(InputError, match=told):
        fill_gaps(x, name="x", longest=5, **options)


def test_the_ends_that_a_channel_lacks_are_cut_from_all(tmp_path):
    x = X.copy()
    x[:30], x[1950:] = np.nan, np.nan
    read = read_recording(table(tmp_path / "run.csv", X, x, "a,b"), sampling_rate=1000)
    assert_array_equal(read.channel("a").samples, X[30:1950])
    assert_array_equal(read.channel("b").samples, X[30:1950])
    assert "cut to samples 30 to 1950, which all channels have" in texts(read)


def test_channels_that_share_little_are_refused(tmp_path):
    x = X.copy()
    x[1000:] = np.nan
    path = table(tmp_path / "run.csv", X, x, "a,b")
    with pytest.raises(InputError, match="do not cover the same time: samples 0 to 1000 of 2000 are shared, and b"):
        read_recording(path, sampling_rate=1000)
    assert read_recording(path, sampling_rate=1000, channels=["a"]).channels[0].samples.size == 2000


def test_an_empty_column_is_no_channel(tmp_path):
    read = read_recording(table(tmp_path / "run.csv", X, X * np.nan, "a,b"), sampling_rate=1000)
    assert [channel.name for channel in read.channels] == ["a"]
    assert "b holds nothing and was left out" in texts(read)
