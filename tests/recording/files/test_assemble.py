"""Unit: files whose columns are times, counts and ramps; epochs and rounded times; tachos that are ramps."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import savemat

from sigdb.core.errors import InputError
from sigdb.recording import read_recording
from sigdb.recording.files.assemble import assemble
from sigdb.recording.files.formats.contents import Contents, DataColumn
from sigdb.recording.files.settings import RecordingSettings

N, FS = 400, 2000.0
K = np.arange(N)
A1 = np.sin(2 * np.pi * 50 * K / FS) + np.random.default_rng(1).normal(0, 0.1, N)
TACHO = 5.0 * (K % 40 < 4)


def table(path, **columns):
    rows = zip(*columns.values(), strict=True)
    text = "\n".join([",".join(columns), *(",".join(f"{value:.17g}" for value in row) for row in rows)])
    path.write_text(text + "\n", encoding="utf-8")
    return path


def texts(recording):
    return [note.text for note in recording.notes]


def recording_of(columns, rates=(), starts=(), **settings):
    rates, starts = dict(rates), dict(starts)
    contents = Contents(
        columns=tuple(
            DataColumn(name=name, values=np.asarray(x), sampling_rate=rates.get(name), start=starts.get(name))
            for name, x in columns.items()
        )
    )
    return assemble(contents, RecordingSettings.model_validate(settings), source="here")


TIMES = [
    ("Time/s", 1), ("t / s", 1), ("x-axis (s)", 1), ("seconds", 1), ("sec", 1), ("X", 1), ("Zeit in s", 1),
    ("time-ms", 1e3), ("time_in_ms", 1e3), ("Time stamp", 1), ("Time - Plot 0", 1), ("Tempo", 1), ("Tid", 1),
    ("Čas", 1), ("时间", 1), ("t[s]", 1), ("Elapsed Time (s)", 1), ("timestamp_ns", 1e9), ("timeMs", 1e3),
    ("t_us", 1e6), ("time(ms)", 1e3), ("T", 1), ("时间 (ms)", 1e3), ("Время [мс]", 1e3), ("XTime", 1),
]  # fmt: skip


@pytest.mark.parametrize(("name", "factor"), TIMES)
@pytest.mark.parametrize("first", [True, False])
def test_a_column_of_times_is_no_channel(tmp_path, name, factor, first):
    t = {name: factor * (0.25 + K / FS)}
    columns = t | {"a1": A1} if first else {"a1": A1} | t
    read = read_recording(table(tmp_path / "run.csv", **columns))
    assert [channel.name for channel in read.channels] == ["a1"]
    assert_allclose(read.channels[0].sampling_rate, FS, rtol=1e-9)
    assert_allclose(read.channels[0].start, 0.25, rtol=1e-9)
    assert read.channels[0].rate_from.startswith("column ")


@pytest.mark.parametrize("name", ["", "Unnamed: 0", "index", "#", "No.", "Sample", "n", "whatever", "ch0"])
@pytest.mark.parametrize("count", [K, K + 1, -K, 5 * K, 1000 - K])
def test_counts_and_ramps_are_no_channels(tmp_path, name, count):
    path = table(tmp_path / "run.csv", **{name: count, "a1": A1, "tacho": TACHO})
    read = read_recording(path, sampling_rate=FS, tacho="tacho")
    assert [channel.name for channel in read.channels] == ["a1", "tacho"]
    assert any("was left out" in text for text in texts(read))
    with pytest.raises(InputError, match="give sampling_rate"):
        read_recording(path)


def test_an_index_beside_the_time(tmp_path):
    read = read_recording(
        table(tmp_path / "run.csv", **{"": K, "time": K / FS, "a1": A1, "tacho": TACHO}), tacho="tacho"
    )
    assert [channel.name for channel in read.signals] == ["a1"]
    assert_allclose(read.channel("a1").sampling_rate, FS, rtol=1e-9)


def test_an_index_of_times(tmp_path):
    read = read_recording(table(tmp_path / "run.csv", **{"": K / FS, "a1": A1}))
    assert [channel.name for channel in read.channels] == ["a1"]
    assert any("rises evenly and was taken as the time in seconds" in text for text in texts(read))


@pytest.mark.parametrize("ramp", [K, K / FS, -K / FS, K / FS + np.random.default_rng(0).uniform(0, 0.3, N) / FS])
def test_a_ramp_is_refused_as_a_channel(tmp_path, ramp):
    with pytest.raises(InputError, match="holds no vibration: level"):
        read_recording(table(tmp_path / "run.csv", level=ramp), sampling_rate=FS)
    path = table(tmp_path / "run.csv", a1=A1, level=ramp)
    with pytest.raises(InputError, match=r"channel level .* so it is no vibration"):
        read_recording(path, sampling_rate=FS, channels=["level"])
    with pytest.raises(InputError, match=r"the tacho level .*; give tacho_kind, 'pulse-times', 'counts' or 'angle'"):
        read_recording(path, sampling_rate=FS, tacho="level")


@pytest.mark.parametrize("kind", ["counts", "angle", "speed"])
def test_a_tacho_may_be_a_ramp(tmp_path, kind):
    path = table(tmp_path / "run.csv", a1=A1, time=K / FS, angle=7.2 * K)
    read = read_recording(path, tacho="angle", tacho_kind=kind)
    assert_array_equal(read.channel("angle").samples, 7.2 * K)
    assert [channel.name for channel in read.signals] == ["a1"]


@pytest.mark.parametrize("name", ["", "index", "record", "packet"])
def test_a_count_that_leaps(tmp_path, name):
    count = np.delete(np.arange(N + 3), slice(200, 203))
    path = table(tmp_path / "run.csv", **{name: count, "a1": A1})
    with pytest.raises(InputError, match=r"counts samples and leaps by 4 after sample 200: samples are missing there"):
        read_recording(path, sampling_rate=FS)
    assert len(read_recording(path, sampling_rate=FS, channels=["a1"]).channels) == 1


@pytest.mark.parametrize("write", ["npz", "mat"])
def test_a_matrix_with_its_time(tmp_path, write):
    matrix = np.stack([K / FS, A1, TACHO], 1)
    path = tmp_path / f"run.{write}"
    np.savez(path, data=matrix) if write == "npz" else savemat(path, {"data": matrix})
    read = read_recording(path, tacho="data3")
    assert [channel.name for channel in read.signals] == ["data2"]
    assert_allclose(read.channel("data2").sampling_rate, FS, rtol=1e-9)
    assert "data1 rises evenly and was taken as the time in seconds; time=false if it is not" in texts(read)


@pytest.mark.parametrize("write", ["npz", "mat"])
def test_an_array_that_counts(tmp_path, write):
    path = tmp_path / f"run.{write}"
    np.savez(path, k=K, a1=A1) if write == "npz" else savemat(path, {"k": K, "a1": A1})
    read = read_recording(path, sampling_rate=FS)
    assert [channel.name for channel in read.channels] == ["a1"]


@pytest.mark.parametrize(("factor", "unit"), [(1, "s"), (1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_times_since_1970(factor, unit):
    read = recording_of({"timestamp": 1.7e9 * factor + K / 500 * factor, "a1": A1})
    assert_allclose(read.channels[0].sampling_rate, 500, rtol=1e-4)
    assert f"column timestamp was read as {unit} since 1970, by its magnitude" in texts(read)
    assert read.channels[0].start == 0


@pytest.mark.parametrize(
    ("t", "name", "told"),
    [
        (1.3e17 + 5000.0 * K, "time", "which is no time in s and no time since 1970; give its unit by units"),
        (1.7e12 + 0.5 * K, "time_s", "which is no time; give its unit by units"),
        (45_000.5 + K / FS / 86_400, "time", "as dates in days do; give its unit by units"),
        (0.5 * K, "time", r"which is 2 Hz if it is in s; give its unit by units, such as units=\{'time': 'ms'\}"),
        (500.0 * K, "time", r"which is 0\.002 Hz if it is in s"),
        (2.0 * K, "time_s", r"gives a sampling rate of 0\.5 Hz, at which no vibration is sampled"),
        (1e-3 * K, "time_ns", r"gives a sampling rate of 1e\+12 Hz, at which no vibration is sampled"),
    ],
)
def test_times_that_cannot_be(t, name, told):
    with pytest.raises(InputError, match=told):
        recording_of({name: t, "a1": A1})


def test_the_unit_of_the_time_by_an_option():
    read = recording_of({"time": 0.5 * K, "a1": A1}, units={"time": "ms", "a1": "g"})
    assert_allclose(read.channels[0].sampling_rate, FS, rtol=1e-9)
    assert read.channels[0].unit == "g"
    days = recording_of({"time": 45_000 + K / FS / 86_400, "a1": A1}, units={"time": "d"})
    assert_allclose(days.channels[0].sampling_rate, FS, rtol=1e-3)


@pytest.mark.parametrize("rate", [1.0, 4000.0])
def test_times_win_over_the_rate_of_a_channel(rate):
    read = recording_of({"Time": K / FS, "a": A1}, {"Time": rate, "a": rate})
    assert_allclose(read.channels[0].sampling_rate, FS, rtol=1e-9)
    assert f"the file states {rate:.9g} Hz; the times were taken" in texts(read)


@pytest.mark.parametrize(
    ("rate", "told"), [(1.0, "which is the default of many programs"), (0.5, "0.5 Hz"), (2e-6, "2e-06"), (2e9, "2e.09")]
)
def test_rates_of_a_file_that_cannot_be(rate, told):
    with pytest.raises(InputError, match=told):
        recording_of({"a": A1}, {"a": rate})
    assert recording_of({"a": A1}, {"a": rate}, sampling_rate=FS).channels[0].sampling_rate == FS


@pytest.mark.parametrize("unit", ["degC", "°C", "N m", "V", "mm"])
def test_a_unit_that_is_no_time(tmp_path, unit):
    path = table(tmp_path / "run.csv", **{"a1 [g]": A1, f"T [{unit}]": 25 + 1e-4 * (K // 2), "u [V]": A1 * 2})
    for options in ({}, {"channels": ["a1"]}):
        read = read_recording(path, sampling_rate=FS, **options)
        assert (read.channels[0].name, read.channels[0].sampling_rate) == ("a1", FS)
    with pytest.raises(InputError, match=r"does not state the sampling rate.*\(T only rises"):
        read_recording(path)
    noisy = table(tmp_path / "noisy.csv", **{"a1": A1, f"T [{unit}]": 25 + A1})
    assert [channel.name for channel in read_recording(noisy, sampling_rate=FS).channels] == ["a1", "T"]


@pytest.mark.parametrize(("digits", "fs"), [(3, 2000.0), (3, 2560.0), (4, 12_800.0), (4, 25_600.0)])
def test_rounded_times(digits, fs):
    """The line whose largest deviation is least has the true slope within 1.5 resolutions over the whole span."""
    read = recording_of({"time": np.round(K / fs, digits), "a1": A1})
    assert abs(read.channels[0].sampling_rate / fs - 1) < 2e-3
    (note,) = (note for note in read.notes if note.code == "rounded-times")
    assert note.values["resolution"] == pytest.approx(10.0**-digits)
    assert note.text.startswith(f"column time is rounded to {10.0**-digits:g} s; the rate is the slope of its times")


def test_rounded_times_since_1970():
    read = recording_of({"time": 1.7e12 + np.round(1e3 * K / FS), "a1": A1})
    assert_allclose(read.channels[0].sampling_rate, FS, rtol=1e-6)
    assert [note.code for note in read.notes] == ["epoch", "sampling-rate", "rounded-times"]


def test_a_time_that_counts_samples():
    read = recording_of({"Time": K, "a1": A1}, sampling_rate=FS)
    assert [channel.name for channel in read.channels] == ["a1"]
    assert "Time counts samples and was left out" in texts(read)
    with pytest.raises(InputError, match=r"\(Time counts samples and was left out\)"):
        recording_of({"Time": K, "a1": A1})
    in_ms = recording_of({"Time_ms": K, "a1": A1})
    assert_allclose(in_ms.channels[0].sampling_rate, 1000, rtol=1e-9)


@pytest.mark.parametrize("lost", [2, 5, 40])
def test_missing_rows_of_rounded_times(lost):
    t = np.round(np.delete(np.arange(N + lost), slice(200, 200 + lost)) / FS, 3)
    with pytest.raises(InputError, match=r"rounded to 0.001 s and is .* samples are missing there"):
        recording_of({"time": t, "a1": A1})


def test_times_rounded_too_coarsely():
    with pytest.raises(InputError, match=r"leaves the rate open: .* Hz within .* %; give sampling_rate"):
        recording_of({"time": np.round(K / FS, 2), "a1": A1})
    read = recording_of({"time": np.round(K / FS, 2), "a1": A1}, sampling_rate=FS)
    assert read.channels[0].sampling_rate == FS


def test_groups_with_times_of_their_rates():
    read = recording_of({"fast/time": K / FS, "fast/a": A1, "slow/time": K / 1900, "slow/b": A1[::-1]})
    rates = {channel.name: channel.sampling_rate for channel in read.channels}
    assert rates == {"fast/a": pytest.approx(2000), "slow/b": pytest.approx(1900)}


def test_starts_of_channels():
    read = recording_of({"vib": A1, "n": TACHO}, {"vib": FS, "n": FS}, {"vib": 0.0, "n": 0.05}, tacho="n")
    assert_array_equal(read.channel("vib").samples, A1[100:])
    assert_array_equal(read.channel("n").samples, TACHO[:300])
    assert [channel.start for channel in read.channels] == [0.05, 0.05]


def test_pulse_times_are_on_the_time_axis():
    pulses = np.full(N, np.nan)
    pulses[:20] = 0.01 * np.arange(20) + 0.003
    read = recording_of(
        {"t": K / FS, "a1": A1, "p": 1e3 * pulses}, tacho="p", tacho_kind="pulse-times", units={"p": "ms"}
    )
    assert_allclose(read.pulse_times, pulses[:20], rtol=1e-12)
    assert [channel.name for channel in read.channels] == ["a1"]
    with pytest.raises(InputError, match="holds no channel besides the pulse times in p"):
        recording_of({"t": K / FS, "p": pulses}, tacho="p", tacho_kind="pulse-times")
    with pytest.raises(InputError, match="two pulse times or more that rise"):
        recording_of({"t": K / FS, "a1": A1, "p": A1}, tacho="p", tacho_kind="pulse-times")


def test_a_speed_of_the_file_is_to_be_confirmed():
    column = DataColumn(name="a", values=A1, sampling_rate=FS)
    contents = Contents(columns=(column,), speed_rpm=1797.0)
    read = assemble(contents, RecordingSettings(), source="here")
    assert read.speed_rpm == 1797
    assert "the file states 1797 rpm, a speed to be confirmed; give speed_rpm" in texts(read)
    assert assemble(contents, RecordingSettings(speed_rpm=900.0), source="here").speed_rpm == 900


@pytest.mark.parametrize(
    ("name", "short", "unit"),
    [
        ("acc [m/s^2]", "acc", "m/s^2"), ("acc (g)", "acc", "g"), ("acc (left)", "acc (left)", ""),
        ("run/V", "run/V", ""), ("acc/g", "acc/g", ""),
    ],
)  # fmt: skip
def test_a_unit_in_brackets_ends_a_name_in_every_format(name, short, unit):
    channel = recording_of({name: A1}, {name: FS}).channels[0]
    assert (channel.name, channel.unit) == (short, unit)


@pytest.mark.parametrize(
    ("head", "quantity"),
    [
        ("Frequency [Hz]", "frequency"),
        ("f [kHz]", "frequency"),
        ("Frequenz", "frequency"),
        ("order", "order"),
        ("crank angle [deg]", "angle"),
        ("Winkel [°]", "angle"),
    ],
)
@pytest.mark.parametrize("options", [{}, {"sampling_rate": 2000}])
def test_a_table_over_frequency_or_angle_is_no_signal(tmp_path, head, quantity, options):
    path = tmp_path / "spectrum.csv"
    path.write_text(f"{head},a1\n" + "".join(f"{5 * i},{i % 7}\n" for i in range(100)), encoding="utf-8")
    with pytest.raises(InputError, match=f"holds the {quantity}, which rises: the other columns run over {quantity}"):
        read_recording(path, **options)


@pytest.mark.parametrize("name", ["f", "freqs", "spec.f", "f_Hz", "omega", "order", "Frekvens"])
@pytest.mark.parametrize("grid", [np.arange(40) * 5.0, 1.1 ** np.arange(40)])
def test_a_spectrum_beside_a_signal_is_left_out(name, grid):
    """A file of a program's variables: the signal, its rate, and a spectrum over its own, shorter axis."""
    read = recording_of({"P": np.abs(A1[:40]), name: grid, "a1": A1}, {"a1": FS})
    assert [channel.name for channel in read.channels] == ["a1"]
    assert f"P runs over {'order' if name == 'order' else 'frequency'}, in {name}" in " ".join(map(str, read.notes))
    with pytest.raises(InputError, match=f"column {name} holds the "):
        recording_of({"P": np.abs(A1[:40]), name: grid}, {"P": FS})


def test_a_clock_that_was_left_out_is_named_where_the_rate_is_missing(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("when,a1\n" + "".join(f"10:00:0{9 - i // 10},{i % 7}.5\n" for i in range(60)), encoding="utf-8")
    with pytest.raises(InputError, match="when holds dates or clock times and was left out: it falls at line 12"):
        read_recording(path)


def test_a_frequency_that_is_measured_is_a_channel(tmp_path):
    path = tmp_path / "run.csv"
    lines = [f"{50 + i * 37 % 5},{i % 7}" for i in range(100)]
    path.write_text("\n".join(["Frequency [Hz],a1", *lines]), encoding="utf-8")
    assert [channel.name for channel in read_recording(path, sampling_rate=2000).channels] == ["Frequency", "a1"]


@pytest.mark.parametrize(("largest", "word"), [(1e31, "1e+31, which no sensor measures"), (np.inf, "infinite")])
def test_numbers_that_no_sensor_measures(largest, word):
    """Their powers, as in kurtosis, are infinite."""
    x = A1.copy()
    x[7] = -largest
    with pytest.raises(InputError, match=re.escape(f"channel a1: sample 7 is {'-' * (largest < 1e99)}{word}; mend it")):
        recording_of({"a1": x}, {"a1": FS})
    with pytest.raises(InputError, match=r"channel a1: scale = 1e\+40 makes it larger than 1e\+30"):
        recording_of({"a1": A1}, {"a1": FS}, scale=1e40)


def test_bits_that_are_no_number_of_single_precision():
    """A signalling nan is a missing sample."""
    x = A1.astype("f4")
    x.view("u4")[7] = 0x7F800001
    assert recording_of({"a1": x}, {"a1": FS}).channels[0].samples.size == N


def test_notes_hold_no_control_characters():
    column = DataColumn(name="a\x001", values=A1, sampling_rate=FS, rate_from="wf_increment of a\x001")
    read = assemble(Contents(columns=(column,), named=True), RecordingSettings(), source="run.tdms")
    assert read.channels[0].rate_from == "wf_increment of a1"
    assert all(note.text.isprintable() for note in read.notes)
