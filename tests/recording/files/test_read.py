"""Unit: recordings, their settings and side files."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.recording import Channel, Recording


def channel(name="a1", n=20):
    return Channel(name=name, samples=np.arange(float(n)), sampling_rate=1000.0)


def table(path, header="a1,a2,n", rows=40):
    path.write_text(header + "\n" + "".join(f"{i % 7},{-i % 5},{i % 2}\n" for i in range(rows)), encoding="utf-8")
    return path


def texts(recording):
    return [note.text for note in recording.notes]


def test_the_tacho_is_no_signal():
    recording = Recording(source="here", channels=(channel("a1"), channel("n"), channel("a2")), tacho="n")
    assert [one.name for one in recording.signals] == ["a1", "a2"]
    assert recording.channel("n").duration == 0.02


def test_an_unknown_channel_is_told_with_those_there_are():
    with pytest.raises(InputError, match=r"here: no channel 'housing'; did you mean 'housing-x'\?"):
        Recording(source="here", channels=(channel("housing-x"),)).channel("housing")
    with pytest.raises(InputError, match="no channel 'zzz'; known: a1"):
        Recording(source="here", channels=(channel("a1"),), tacho="zzz")


@pytest.mark.parametrize(
    ("samples", "rate", "told"),
    [
        (np.zeros((2, 2)), 1.0, r"shape \(2, 2\)"),
        (np.zeros(0), 1.0, r"shape \(0,\)"),
        (np.zeros(3, np.float32), 1.0, "type float32"),
        (np.array([0.0, np.nan]), 1.0, "must be finite"),
        (np.zeros(3), 0.0, "sampling_rate = 0.0 must be a positive number"),
        (np.zeros(3), np.nan, "sampling_rate = nan must be a positive number"),
    ],
)
def test_a_channel_is_a_finite_series(samples, rate, told):
    with pytest.raises(InputError, match=told):
        Channel(name="a1", samples=samples, sampling_rate=rate)


def test_a_recording_has_channels_of_different_names():
    with pytest.raises(InputError, match="at least one channel"):
        Recording(source="here", channels=())
    with pytest.raises(InputError, match="different names, not a1, a1"):
        Recording(source="here", channels=(channel(), channel()))


def test_options_name_scale_and_describe(tmp_path):
    read = sigdb.read_recording(
        table(tmp_path / "run.csv"), sampling_rate=1000, names=["x", "y", "mark"], channels=["y", "x"], tacho="mark",
        units="g", scale={"x": 0.5}, pulses_per_rev=2, ratio=0.4, teeth=32, speed_rpm=1780.0, torque=12.0,
    )  # fmt: skip
    assert [(one.name, one.unit) for one in read.channels] == [("y", "g"), ("x", "g"), ("mark", "")]
    assert read.channel("x").samples[:4].tolist() == [0, 0.5, 1, 1.5]
    assert (read.tacho, read.pulses_per_rev, read.ratio) == ("mark", 2, 0.4)
    assert (read.teeth, read.speed_rpm, read.torque) == (32, 1780.0, 12.0)
    assert "x was multiplied by 0.5" in texts(read)


def test_one_scale_is_not_the_tachos(tmp_path):
    read = sigdb.read_recording(table(tmp_path / "run.csv"), sampling_rate=1000, tacho="n", scale=10)
    assert read.channel("n").samples.max() == 1
    assert read.channel("a1").samples.max() == 60


def test_a_side_file_gives_what_options_do_not(tmp_path):
    path = table(tmp_path / "run.csv")
    text = 'sampling_rate = 500\ntacho = "n"\ntorque = 40\nload = 80\n[units]\na1 = "m/s^2"\n'
    (tmp_path / "run.toml").write_text(text, encoding="utf-8")
    read = sigdb.read_recording(path)
    assert (read.torque, read.load) == (40, 80)
    assert (read.channel("a1").sampling_rate, read.channel("a1").unit, read.tacho) == (500, "m/s^2", "n")
    assert sigdb.read_recording(path, sampling_rate=600).channel("a1").sampling_rate == 600


@pytest.mark.parametrize("place", [".", "../parts"])
def test_the_side_file_of_a_folder_bears_its_name(tmp_path, monkeypatch, place):
    folder = tmp_path / "parts"
    folder.mkdir()
    table(folder / "run.csv")
    (tmp_path / "parts.toml").write_text("sampling_rate = 500\ntorque = 40\n", encoding="utf-8")
    monkeypatch.chdir(folder)
    assert sigdb.read_recording(place).torque == 40


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("samplingrate = 1", r"run\.toml: unknown key samplingrate; did you mean 'sampling_rate'\?"),
        ("sampling_rate = -1\nteeth = 0", r"sampling_rate = -1 must be .*; .*teeth = 0 must be"),
        ("sampling_rate = nan", "sampling_rate = nan must be"),
        ("a = [", r"run\.toml: not valid TOML"),
        ("a = " + "[" * 100_000, r"run\.toml: tables or arrays are nested more than 64 deep"),
        ("# " + "x" * 2**20, r"run\.toml: larger than 1048576 bytes"),
    ],
)
def test_a_side_file_is_checked(tmp_path, text, told):
    path = table(tmp_path / "run.csv")
    (tmp_path / "run.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=told) as caught:
        sigdb.read_recording(path, sampling_rate=1000)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"samplingrate": 3}, "read_recording: unknown key samplingrate"),
        ({"sampling_rate": 0}, "sampling_rate = 0 must be"),
        ({"channels": ["a1", "b"]}, "no channel 'b'"),
        ({"tacho": "b"}, "tacho names 'b', which is no channel"),
        ({"units": {"b": "g"}}, "units names 'b', which is no channel"),
        ({"scale": {"b": 2.0}}, "scale names 'b', which is no channel"),
        ({"scale": 1e308}, "scale = 1e.308 makes it larger than 1e.30"),
        ({"names": ["x"]}, "names gives 1 names, the file holds 3 columns"),
        ({"time": "b"}, "no column 'b' with the time"),
        ({}, "does not state the sampling rate; give sampling_rate, in Hz"),
    ],
)
def test_options_are_checked(tmp_path, options, told):
    with pytest.raises(InputError, match=told):
        sigdb.read_recording(table(tmp_path / "run.csv"), **({"sampling_rate": 1000} if options else {}) | options)


def test_columns_of_one_name_are_told_apart(tmp_path):
    read = sigdb.read_recording(table(tmp_path / "run.csv", header="a,a,a (2)"), sampling_rate=1000)
    assert len({one.name for one in read.channels}) == 3
    assert any("a second column a is called" in note for note in texts(read))


def test_dead_and_doubled_channels_are_told(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("a,b,c\n" + "".join(f"{i % 7}.5,3,{i % 7}.5\n" for i in range(40)), encoding="utf-8")
    read = sigdb.read_recording(path, sampling_rate=1000)
    assert texts(read) == ["b is constant", "c is the same as a"]
    assert [(note.code, dict(note.values)) for note in read.notes] == [
        ("constant-channel", {"channel": "b", "count": 1, "share": 1.0, "first_s": 0.0}),
        ("same-channel", {"channel": "c", "same": "a"}),
    ]


def test_what_is_no_file_is_told(tmp_path):
    with pytest.raises(InputError, match=r"nothing\.csv: no such file"):
        sigdb.read_recording(tmp_path / "nothing.csv")
    with pytest.raises(InputError, match="holds no files of a recording"):
        sigdb.read_recording(tmp_path)
