"""Validation: fields, dates and metadata of NumPy's files and of Parquet."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from numpy.testing import assert_array_equal
from pyarrow import parquet

from sigdb.core.errors import InputError
from sigdb.recording import read_recording

X = np.sin(np.arange(60.0))
FIRST = np.datetime64("2024-01-01T10:00:00")


def texts(recording):
    return [note.text for note in recording.notes]


def fields(kind="<f8", time="<f8", times=None):
    rows = np.zeros(60, [("t", time), ("a1", kind), ("xy", "<f4", (2,)), ("word", "S3")])
    rows["t"] = np.arange(60) / 250 if times is None else times
    rows["a1"], rows["xy"][:, 1] = X, X
    return rows


@pytest.mark.parametrize("kind", ["<f8", ">f8"])
def test_fields_of_an_array_are_columns(tmp_path, kind):
    np.save(tmp_path / "run.npy", fields(kind))
    read = read_recording(tmp_path / "run.npy")
    assert [one.name for one in read.channels] == ["a1", "xy1", "xy2"]
    assert [one.sampling_rate for one in read.channels] == pytest.approx([250] * 3)
    assert_array_equal(read.channel("a1").samples, X)
    assert "word is an array of |S3, not of numbers" in texts(read)


def test_fields_of_arrays_of_npz(tmp_path):
    np.savez(tmp_path / "run.npz", run=fields(), fs=250.0, about="a run", unit="g")
    read = read_recording(tmp_path / "run.npz", channels=["run.a1"])
    assert (read.channels[0].name, read.channels[0].sampling_rate) == ("run.a1", pytest.approx(250))


@pytest.mark.parametrize("unit", ["ns", "us", "10us"])
def test_dates_are_times(tmp_path, unit):
    steps = (np.arange(60) * 4000).astype("m8[us]").astype(f"m8[{unit}]")
    times = FIRST.astype(f"M8[{unit}]") + steps
    np.savez(tmp_path / "run.npz", stamp=times, a1=X)
    assert read_recording(tmp_path / "run.npz").channels[0].sampling_rate == pytest.approx(250)
    np.savez(tmp_path / "run.npz", stamp=steps, a1=X)
    assert read_recording(tmp_path / "run.npz").channels[0].sampling_rate == pytest.approx(250)
    np.save(tmp_path / "run.npy", fields(time=times.dtype.str, times=times))
    assert read_recording(tmp_path / "run.npy").channels[0].sampling_rate == pytest.approx(250)


def test_months_are_no_seconds(tmp_path):
    np.savez(tmp_path / "run.npz", when=np.arange(60).astype("M8[M]"), a1=X)
    with pytest.raises(InputError, match="holds times in 'M', which is no unit of seconds"):
        read_recording(tmp_path / "run.npz")


def test_names_beyond_latin_1(tmp_path):
    """NPY version 3."""
    rows = np.zeros(60, [("振动", "<f8"), ("Δa", "<f8")])
    rows["振动"], rows["Δa"] = X, X**2
    with pytest.warns(UserWarning, match="can only be read by NumPy"):
        np.save(tmp_path / "run.npy", rows)
    read = read_recording(tmp_path / "run.npy", sampling_rate=10)
    assert [one.name for one in read.channels] == ["振动", "Δa"]
    assert_array_equal(read.channels[1].samples, X**2)


def test_order_of_bytes_and_of_columns(tmp_path):
    matrix = np.asfortranarray(np.stack([X, X**2], 1)).astype(">f4")
    np.save(tmp_path / "run.npy", matrix)
    read = read_recording(tmp_path / "run.npy", sampling_rate=10)
    assert_array_equal(read.channels[1].samples, (X**2).astype("f4"))


def test_objects_within_fields_are_refused(tmp_path):
    rows = np.zeros(60, [("a1", "<f8"), ("who", object)])
    np.save(tmp_path / "run.npy", rows, allow_pickle=True)
    with pytest.raises(InputError, match="it is an array of Python objects, not of numbers"):
        read_recording(tmp_path / "run.npy", sampling_rate=10)


@pytest.mark.parametrize("index", ["date", "duration", "zone", "named", "number"])
def test_indices_of_pandas(tmp_path, index):
    seconds = np.arange(60) / 250
    made = {
        "date": pd.to_datetime(1.7e9 + seconds, unit="s"),
        "duration": pd.to_timedelta(seconds, unit="s"),
        "zone": pd.to_datetime(1.7e9 + seconds, unit="s", utc=True),
        "named": pd.Index(pd.to_datetime(1.7e9 + seconds, unit="s"), name="measured at"),
        "number": pd.Index(seconds, name="time"),
    }[index]
    pd.DataFrame({"a1": X, "a2": X**2}, index=made).to_parquet(tmp_path / "run.parquet")
    read = read_recording(tmp_path / "run.parquet")
    assert [one.name for one in read.channels] == ["a1", "a2"]
    assert [one.sampling_rate for one in read.channels] == pytest.approx([250] * 2, rel=1e-4)


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_timestamps_of_parquet(tmp_path, unit):
    times = pa.array(np.arange(60) * (1 if unit == "s" else 4), pa.timestamp(unit))
    parquet.write_table(pa.table({"time": times, "a1": X}), tmp_path / "run.parquet")
    if unit == "s":  # 1 Hz is no rate of a vibration
        with pytest.raises(InputError, match="at which no vibration"):
            read_recording(tmp_path / "run.parquet")
    else:
        rate = read_recording(tmp_path / "run.parquet").channels[0].sampling_rate
        assert rate == pytest.approx({"ms": 250.0, "us": 250e3, "ns": 250e6}[unit])


def test_a_missing_timestamp_is_refused(tmp_path):
    times = pa.array([*range(59), None], pa.timestamp("ms"))
    parquet.write_table(pa.table({"time": times, "a1": X}), tmp_path / "run.parquet")
    with pytest.raises(InputError, match="time"):
        read_recording(tmp_path / "run.parquet")


@pytest.mark.parametrize("key", ["unit", "units"])
def test_metadata_of_parquet(tmp_path, key):
    field = pa.field("a1", pa.float32(), metadata={key: "m/s^2"})
    table = pa.table([X.astype("f4")], schema=pa.schema([field], metadata={"fs": "12800"}))
    parquet.write_table(table, tmp_path / "run.parquet")
    (channel,) = read_recording(tmp_path / "run.parquet").channels
    assert (channel.unit, channel.sampling_rate) == ("m/s^2", 12_800)
