"""Unit: arrays, pandas objects and SEP005 dictionaries as recordings."""

from datetime import UTC, datetime

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import recording_from

N, FS = 400, 2000.0
X = np.random.default_rng(5).normal(size=(N, 2))
T = np.arange(N) / FS


def names(recording):
    return [channel.name for channel in recording.channels]


def texts(recording):
    return [note.text for note in recording.notes]


@pytest.mark.parametrize("data", [X[:, 0], X[:, 0].tolist(), X[:, :1], X[:, 0].astype(np.float32)])
def test_an_array_of_one_channel(data):
    read = recording_from(data, sampling_rate=FS, names=["a1"], units="g")
    (channel,) = read.channels
    assert (channel.name, channel.unit, channel.sampling_rate, read.source) == ("a1", "g", FS, "data")
    assert_allclose(channel.samples, X[:, 0], rtol=1e-6)


@pytest.mark.parametrize("data", [X, X.T, np.asfortranarray(X)])
def test_an_array_of_channels(data):
    read = recording_from(data, sampling_rate=FS, source="rig 3", tacho="column2")
    assert names(read) == ["column1", "column2"]
    assert_array_equal(read.channel("column2").samples, X[:, 1])
    assert read.source == "rig 3"


def test_a_matrix_with_its_time():
    read = recording_from(np.column_stack([T, X]))
    assert names(read) == ["column2", "column3"]
    assert_allclose(read.channels[0].sampling_rate, FS, rtol=1e-9)


def test_data_are_not_shared():
    x = X[:, 0].copy()
    read = recording_from(x, sampling_rate=FS)
    x[:] = 7
    assert_array_equal(read.channels[0].samples, X[:, 0])


def test_a_mask_is_missing():
    x = np.ma.masked_array(X[:, 0].copy(), mask=np.arange(N) == 100)
    x.data[100] = 1e6
    read = recording_from(x, sampling_rate=FS)
    assert read.channels[0].samples[100] == pytest.approx((X[99, 0] + X[101, 0]) / 2)
    whole = np.ma.masked_array(np.arange(N) * 7 % 31, mask=False)
    assert recording_from(whole, sampling_rate=FS).channels[0].samples.max() == 30
    with pytest.raises(InputError, match="data: channel column: 7 samples are missing from sample 50 on"):
        recording_from(np.ma.masked_array(X[:, 0], mask=(np.arange(N) >= 50) & (np.arange(N) < 57)), sampling_rate=FS)


def test_a_dictionary_of_arrays():
    read = recording_from({"a1": X[:, 0], "n": X[:, 1], "fs": "2 kHz", "rpm": 900, "k": np.arange(N)}, tacho="n")
    assert names(read) == ["a1", "n"]
    assert (read.channels[0].sampling_rate, read.speed_rpm) == (2000, 900)
    assert "k counts samples and was left out" in texts(read)


INDICES = {
    "seconds": pd.Index(T),
    "named": pd.Index(1e3 * T, name="time_ms"),
    "dates": pd.to_datetime(1_700_000_000_000_000_000 + (T * 1e9).astype(np.int64)),
    "zone": pd.to_datetime(1_700_000_000_000_000_000 + (T * 1e9).astype(np.int64)).tz_localize("Europe/Berlin"),
    "timedelta": pd.to_timedelta(T * 1e9, unit="ns"),
    "milliseconds": pd.to_datetime(np.round(T * 1e6).astype(np.int64), unit="us"),
}


@pytest.mark.parametrize("index", INDICES)
def test_indices_of_times(index):
    frame = pd.DataFrame({"a1": X[:, 0], "a2": X[:, 1]}, index=INDICES[index])
    frame.attrs["units"] = {"a1": "g"}
    read = recording_from(frame)
    assert [(channel.name, channel.unit) for channel in read.channels] == [("a1", "g"), ("a2", "")]
    assert_allclose([channel.sampling_rate for channel in read.channels], FS, rtol=1e-6)
    series = recording_from(frame["a2"])
    assert names(series) == ["a2"]
    assert_array_equal(series.channels[0].samples, X[:, 1])


@pytest.mark.parametrize(("name", "seconds"), [("Time [s]", 1.0), ("t (ms)", 1e-3), ("time [µs]", 1e-6)])
def test_an_index_whose_name_holds_its_unit(name, seconds):
    frame = pd.DataFrame({"a1 [g]": X[:, 0]}, index=pd.Index(T / seconds, name=name))
    recording = recording_from(frame)
    assert [(channel.name, channel.unit) for channel in recording.channels] == [("a1", "g")]
    assert recording.channels[0].sampling_rate == pytest.approx(FS, rel=1e-9)


@pytest.mark.parametrize("index", [None, pd.Index(np.arange(N)), pd.Index(np.arange(5, N + 5), name="n")])
def test_indices_that_count(index):
    frame = pd.DataFrame({"a1": X[:, 0]}, index=index)
    assert names(recording_from(frame, sampling_rate=FS)) == ["a1"]
    with pytest.raises(InputError, match="does not state the sampling rate"):
        recording_from(frame)


@pytest.mark.parametrize("index", ["seconds", "dates", "timedelta"])
def test_rows_that_were_dropped(index):
    frame = pd.DataFrame({"a1": X[:, 0]}, index=INDICES[index]).drop(INDICES[index][100:103])
    with pytest.raises(InputError, match="leaps by 4 steps after sample 100: samples are missing there"):
        recording_from(frame)
    with pytest.raises(InputError, match="column index counts samples and leaps by 4 after sample 100"):
        recording_from(pd.DataFrame({"a1": X[:, 0]}).drop(index=range(100, 103)), sampling_rate=FS)


def test_columns_of_other_types():
    frame = pd.DataFrame(
        {
            "a1 [m/s^2]": pd.array([None, *X[1:, 0]], dtype="Float64"),
            "count": pd.array(np.arange(N) * 7 % 31, dtype="Int64"),
            "on": np.arange(N) % 2 == 0,
            "who": ["x"] * N,
            ("a", "b"): X[:, 1],
        },
        index=pd.Index(T),
    )
    read = recording_from(frame)
    assert [(channel.name, channel.unit) for channel in read.channels][:2] == [("a1", "m/s^2"), ("count", "")]
    assert names(read)[2:] == ["on", "a/b"]
    assert read.channels[0].samples.size == N - 1
    assert any(text.startswith("who is of type") for text in texts(read))


def test_a_column_of_dates():
    frame = pd.DataFrame({"time": INDICES["dates"], "a1": X[:, 0]})
    assert_allclose(recording_from(frame).channels[0].sampling_rate, FS, rtol=1e-6)


def test_sep005():
    a1 = {"name": "a1", "data": X[:, 0], "unit_str": "m/s²", "fs": 2000}
    read = recording_from([a1, {"name": "n", "data": X[:, 1], "unit_str": "V", "time": T}], tacho="n")
    assert [(channel.name, channel.unit) for channel in read.channels] == [("a1", "m/s²"), ("n", "V")]
    assert_allclose([channel.sampling_rate for channel in read.channels], FS, rtol=1e-9)
    assert [channel.rate_from for channel in read.channels] == ["fs of a1", "time of n"]
    assert names(recording_from(a1)) == ["a1"]
    assert names(recording_from(a1 | {"data": X[:, :1].T})) == ["a1"]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("2024-05-01 10:00:00", "2024-05-01T10:00:00.050"),
        (datetime(2024, 5, 1, 10, tzinfo=UTC), pd.Timestamp("2024-05-01T12:00:00.050+02:00")),
    ],
)
def test_sep005_that_start_at_different_times(first, second):
    stamps = (first, second)
    channels = [
        {"name": f"a{i}", "data": X[:, i], "unit_str": "g", "fs": FS, "start_timestamp": stamps[i]} for i in (0, 1)
    ]
    read = recording_from(channels)
    assert_array_equal(read.channel("a0").samples, X[100:, 0])
    assert_array_equal(read.channel("a1").samples, X[:300, 1])
    assert read.channel("a1").start == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ("run.csv", "data: is a text or a path; give read_recording a file"),
        ([[1.0, 2.0], [3.0]], "the array has rows of different lengths; give rows of one length"),
        (np.array([object()] * 20), "the array holds object, not real numbers"),
        (X[:, 0] * 1j, "holds complex128, not real numbers"),
        (T, "holds no channel besides the times in column"),
        ({"name": "a", "unit_str": "g", "data": X[:, 0]}, "does not state the sampling rate"),
        ({"name": "a", "data": X[:, 0], "fs": -1}, "fs of a = -1 must be a positive number"),
        ({"name": "a", "data": X[:, 0], "fs": 1000, "time": T}, "a: fs = 1000 Hz, but its times give 2000 Hz"),
        ({"name": "a", "data": X[:, 0], "time": T[:-1]}, r"a has 399 times and data of shape \(400,\); give as many"),
        ({"name": "a", "data": X[:, 0], "fs": FS, "start_timestamp": "noon"}, "start_timestamp = 'noon' is no date"),
        ([{"name": "a", "fs": FS}], "a has no data; a SEP005 dictionary holds"),
        ({"name": "a", "data": X[:, 0], "fs": 0.5}, "fs of a states a sampling rate of 0.5 Hz"),
        (pd.DataFrame({"who": ["x"] * N}), "holds no column of numbers: who is of type"),
        (pd.DataFrame({"a": X[:, 0]}, index=INDICES["dates"][::-1]), "column time must rise"),
        (3.0, "holds no array of 16 numbers or more"),
    ],
)
def test_what_is_no_recording(data, told):
    with pytest.raises(InputError, match=told):
        recording_from(data)


@pytest.mark.parametrize("option", ["file_format", "variable", "separator", "decimal"])
def test_options_of_files(option):
    with pytest.raises(InputError, match=f"data: {option} is an option of files; leave it out"):
        recording_from(X, sampling_rate=FS, **{option: ","})
