"""Unit: rates, starts, units and speeds that entries of a file state about its arrays."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.formats.named_arrays import contents_of_arrays
from sigdb.recording.files.formats.stated_rates import rate_of, speed_of, start_of, stated_rate

X = np.random.default_rng(8).normal(size=400)


def contents(texts=None, **arrays):
    return contents_of_arrays(
        {name.replace("__", "."): np.asarray(value) for name, value in arrays.items()}, texts=texts
    )


def rates_of(read):
    return {column.name: column.sampling_rate for column in read.columns}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fs", 2000), ("Fs", 2000.0), ("sr", 2000), ("f_sample", 2000), ("SampFreq", 2000), ("samp_rate", 2000),
        ("sampling_freq", [[2000]]), ("SampleRate", 2000), ("Sample Rate", "2000"), ("Sample Rate", "2000 Hz"),
        ("Sample rate [kHz]", 2), ("fs_kHz", 2), ("fs_Hz", 2000), ("samplingRateHz", 2000), ("fs", "2 kHz"),
        ("Ts", 5e-4), ("dt", 5e-4), ("deltaT", 5e-4), ("delta_t", 5e-4), ("Tinterval", 5e-4), ("dt_ms", 0.5),
        ("dt", "0.5 ms"), ("Sampling Interval", "500 us"), ("ch1.x_values.increment", 5e-4), ("run/fs.value", 2000),
        ("fs", [2000, 2000]), ("sample_rate", np.bytes_("2000")), ("X-axis.delta", 5e-4), ("采样频率", 2000),
        ("f_s", 2000), ("Fréquence d'échantillonnage", 2000), ("Abtastfrequenz", 2000), ("scan_rate", 2000),
    ],
)  # fmt: skip
def test_names_of_rates(name, value):
    assert rate_of(name, value) == pytest.approx(2000)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("load", 3), ("fs", 0), ("fs", -2000), ("fs", np.nan), ("fs", "fast"), ("fs", [2000, 4000]), ("fs", "2000 m"),
        ("rate", 25), ("frequency", 50), ("increment", 5e-4), ("y_values.increment", 5e-4), ("dt", "2000 Hz"),
        ("filter_frequency", 100), ("dt", 0.0), ("fs", 1j),
    ],
)  # fmt: skip
def test_other_numbers_state_no_rate(name, value):
    assert rate_of(name, value) is None


def test_names_of_channels_in_names_of_rates():
    assert stated_rate("fs_vib", 2000) == (2000, "vib")
    assert stated_rate("tacho_Ts", 0.5) == (2, "tacho")
    assert stated_rate("Fs1", 2000) == (2000, "1")
    assert rate_of("fs_vib", 2000) is None


@pytest.mark.parametrize(
    ("name", "value", "speed"),
    [
        ("X097RPM", [[1796]], 1796), ("rpm", 900, 900), ("speed_rpm", "900", 900), ("rpm_motor", 1500.5, 1500.5),
        ("bearing.rate", 25, 1500), ("speed", "900 rpm", 900), ("rate", 12_800, None), ("load", 3, None),
        ("rpm", -5, None), ("speed", 900, None),
    ],
)  # fmt: skip
def test_speeds(name, value, speed):
    assert speed_of(name, value) == speed


def test_starts():
    assert start_of("ch1.t0", 0.05) == 0.05
    assert start_of("x_values.start_value", 2) == 2
    assert start_of("t0_ms", 50) == pytest.approx(0.05)
    assert start_of("start", 5) is None


def test_each_channel_has_the_rate_of_its_structure():
    read = contents(ch1__data=X, ch1__fs=2000, ch2__data=X, ch2__fs=4000)
    assert rates_of(read) == {"ch1.data": 2000, "ch2.data": 4000}
    assert [column.rate_from for column in read.columns] == ["ch1.fs", "ch2.fs"]
    assert not read.notes


def test_the_innermost_rate_holds():
    read = contents(fs=1000, a=X, fast__fs=5000, fast__deep__b=X, slow__c=X)
    assert rates_of(read) == {"a": 1000, "fast.deep.b": 5000, "slow.c": 1000}


def test_rates_below_an_abscissa_and_beside_the_data():
    read = contents(s__x_values__increment=5e-4, s__x_values__start_value=0.25, s__y_values__values=X)
    (column,) = read.columns
    assert (column.sampling_rate, column.start) == (2000, 0.25)
    assert rates_of(contents(info__Fs=2000, data=X)) == {"data": 2000}


def test_rates_with_the_names_of_arrays():
    assert rates_of(contents(vib=X, tacho=X, fs_vib=2000, fs_tacho=4000)) == {"vib": 2000, "tacho": 4000}
    assert rates_of(contents(a1=X, a2=X, fs1=2000, fs2=4000)) == {"a1": 2000, "a2": 4000}


@pytest.mark.parametrize("entries", [{"fs": 2000, "dt": 0.1}, {"fs": 2000, "sr": 4000}, {"fs_left": 1, "fs_right": 9}])
def test_rates_that_contradict_each_other(entries):
    read = contents(a=X, **entries)
    assert rates_of(read) == {"a": None}
    assert [note.code for note in read.notes] == ["different-rates"]


def test_rates_that_agree():
    read = contents(a=X, fs=12_800, dt=7.8125e-5, Ts=7.813e-5)
    assert rates_of(read) == {"a": 12_800}
    assert not read.notes


def test_the_only_rate_holds_for_arrays_without_one():
    read = contents(ch1__data=X, ch1__fs=2000, ch2__data=X)
    assert rates_of(read) == {"ch1.data": 2000, "ch2.data": 2000}
    assert [note.text for note in read.notes] == ["ch2.data states no sampling rate; that of ch1.fs was taken"]
    assert rates_of(contents(a__x=X, a__fs=1, b__x=X, b__fs=2, c__x=X))["c.x"] is None


def test_units_and_abscissas_in_texts():
    texts = {"a.unit": "g", "b.y_values.quantity.label": "m/s^2", "b.x_values.quantity.label": "Hz", "c.xunit": "s"}
    read = contents(texts, a__x=X, a__t=np.arange(400) / 2000, b__y_values__values=X, c__x=X)
    assert {column.name: (column.unit, column.abscissa) for column in read.columns} == {
        "a.x": ("g", "time"), "a.t": ("", "time"), "b.y_values.values": ("m/s^2", "an abscissa in Hz"),
        "c.x": ("", "time"),
    }  # fmt: skip


def test_a_speed_is_to_be_confirmed():
    read = contents(X097_DE_time=X, X097RPM=[[1796]])
    assert read.speed_rpm == 1796
    assert [note.text for note in read.notes] == ["X097RPM states 1796 rpm, a speed to be confirmed; give speed_rpm"]
    different = contents(a=X, rpm1=900, rpm2=1000)
    assert different.speed_rpm is None
    assert [note.code for note in different.notes] == ["different-speeds"]


@pytest.mark.parametrize("write", ["npz", "mat", "h5"])
def test_rates_by_channel_in_files(tmp_path, write):
    path = tmp_path / f"run.{write}"
    if write == "mat":
        savemat(path, {"ch1": {"data": X, "fs": "2000 Hz"}, "ch2": {"data": X[::-1], "Ts": 1 / 1990}})
    elif write == "npz":
        np.savez(path, **{"ch1.data": X, "ch1.fs": "2000", "ch2.data": X[::-1], "ch2.Ts": 1 / 1990})
    else:
        with h5py.File(path, "w") as file:
            file["ch1/data"], file["ch2/data"] = X, X[::-1]
            file["ch1"].attrs["SampFreq"] = "2000"
            file["ch2"].attrs["deltaT"] = 1 / 1990
    read = read_recording(path)
    assert [channel.sampling_rate for channel in read.channels] == pytest.approx([2000, 1990])


@pytest.mark.parametrize(("entry", "value"), [("fs", 0.5), ("Ts", 2000), ("dt", 1.0)])
def test_rates_that_cannot_be_are_refused(tmp_path, entry, value):
    np.savez(tmp_path / "run.npz", x=X, **{entry: value})
    with pytest.raises(InputError, match=f"channel x: {entry} states a sampling rate of"):
        read_recording(tmp_path / "run.npz")


def test_a_speed_of_a_mat_file(tmp_path):
    savemat(tmp_path / "run.mat", {"bearing": {"gs": X, "sr": 2000, "rate": 25, "load": 270}})
    read = read_recording(tmp_path / "run.mat")
    assert (read.channels[0].sampling_rate, read.speed_rpm) == (2000, 1500)
    assert any(note.code == "speed-to-confirm" for note in read.notes)
    stated = read_recording(tmp_path / "run.mat", speed_rpm=1490.0)
    assert stated.speed_rpm == 1490
    assert all(note.code != "speed-to-confirm" for note in stated.notes)
    far = read_recording(tmp_path / "run.mat", speed_rpm=100.0)
    assert "bearing.rate states 1500 rpm; the given 100 rpm was taken" in [note.text for note in far.notes]
