"""Unit: names, units and facts above the tables that recorders, oscilloscopes and programs write."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import RecordingSettings
from sigdb.recording.files.formats.text.reader import read_text

N = 60
T = np.arange(N) / 2000
X = np.round(150 * np.sin(2 * np.pi * 100 * T), 4)
PULSES = np.where(np.arange(N) % 10 == 0, 5.0, 0.0)


def rows(separator=",", form="{t:.6f}|{x:.4f}|{p:.3f}", decimal="."):
    lines = (form.format(i=i, t=T[i], ms=1000 * T[i] - 50, x=X[i], p=PULSES[i]) for i in range(N))
    return [line.replace(".", decimal).replace("|", separator) for line in lines]


def contents(path, lines, coding="utf-8", ends="\n"):
    path.write_bytes((ends.join(lines) + ends).encode(coding))
    return read_text(path, RecordingSettings())


def named(read):
    return [(column.name, column.unit) for column in read.columns]


THREE = [("Time", "s"), ("a1", "g"), ("tacho", "V")]
HEADERS = {
    "blank line": ["Time,a1,tacho", "s,g,V", ""],
    "blank lines": ["Time,a1,tacho", "", "s,g,V", "", ""],
    "brackets": ["Time,a1,tacho", "(s),(g),(V)", ""],
    "square brackets": ["Time,a1,tacho", "[s],[g],[V]"],
    "in the names": ["Time (s),a1 [g],tacho {V}"],
    "after slashes": ["Time/s,a1 / g,tacho/V"],
    "after in": ["Time in s,a1 in g,tacho in V"],
    "quoted": ['"Time","a1","tacho"', '"s","g","V"'],
    "rule": ["Time,a1,tacho", "s,g,V", "---,---,---"],
    "long rule": ["Time,a1,tacho", "s,g,V", "-----------------"],
    "axes": ["Time,a1,tacho", "s,g,V", "X,Z,"],
    "axes first": ["X,Z,", "Time,a1,tacho", "s,g,V"],
    "axes between": ["Time,a1,tacho", ",X,Z", "s,g,V"],
    "description": ["Time,a1,tacho", "s,g,V", "Zeit seit Start,Beschleunigung vorn links,Drehzahlgeber am Motor"],
    "description first": ["Seconds since start,Acceleration at front,Key phasor", "Time,a1,tacho", "s,g,V"],
    "description between": ["Time,a1,tacho", "Seconds since start,Acceleration at front,Key phasor", "s,g,V"],
    "units first": ["s,g,V", "Time,a1,tacho"],
    "comment marks": ["# Time,a1,tacho", "# s,g,V"],
    "percent": ["% Time,a1,tacho", "% s,g,V"],
    "comments above": ["# rig 7, run 3", "#", "#Time,a1,tacho", "#s,g,V"],
    "slashes": ["// Time,a1,tacho", "// s,g,V"],
    "title": ["Test rig 7", "Time,a1,tacho", "s,g,V"],
    "mark of data": ["Time,a1,tacho", "s,g,V", "[Data]"],
    "labels": ["Name:,a1,tacho", "Unit:,g,V"],
    "facts": ["Operator: M. Weber", "Date: 2024-03-01 10:00:00", "Points,60", "Time,a1,tacho", "s,g,V"],
    "values below labels": [
        "channel names:",
        "Time\ta1\ttacho",
        "units:",
        "s\tg\tV",
        "start times:",
        "03/01/2024 10:00:00.0\t03/01/2024 10:00:00.0\t03/01/2024 10:00:00.0",
        "dt:",
        "0.0005\t0.0005\t0.0005",
        "data:",
    ],
    "facts between": ["Time,a1,tacho", "Sample rate: 2000 Hz", "s,g,V"],
}


@pytest.mark.parametrize("kind", HEADERS)
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_names_and_units_wherever_they_stand(tmp_path, kind, ends):
    read = contents(tmp_path / "run.csv", [*HEADERS[kind], *rows()], ends=ends)
    assert named(read) == ([("column1", ""), *THREE[1:]] if kind == "labels" else THREE)
    assert_array_equal(
        np.stack([column.values for column in read.columns], 1), np.stack([np.round(T, 6), X, PULSES], 1)
    )


@pytest.mark.parametrize("separator", ["\t", ";", ", "])
@pytest.mark.parametrize("kind", ["blank line", "axes", "description", "comment marks", "title", "units first"])
def test_headers_with_other_separators(tmp_path, kind, separator):
    header = [line.replace(",", separator) for line in HEADERS[kind]]
    assert named(contents(tmp_path / "run.txt", [*header, *rows(separator)])) == THREE


@pytest.mark.parametrize(
    "units",
    [
        "sec,ips,counts", "second,Volt,Volt", "s,m/s²,V", "ms,mV,V", "s,µm,°C", "s,mm/s,rpm", "s,N,bar", "s,kPa,N·m",
        "s,m/s^2,1/min", "s,g,-", "µs,in/s,mA", "Seconds,inch/s,Volts", "s,(m/s2),(V)", "s,gn,U/min", "h,mils,psi",
        "s,deg,rad/s", "s,Nm,K", "s,g rms,%", "s,mm/s rms,Hz", "s,m s^-2,kN", "s,dB,Pa", "s,um,degF",
    ],
)  # fmt: skip
def test_lines_of_units(tmp_path, units):
    words = [word.strip("()") for word in units.split(",")]
    for header in (["Time,a1,tacho", units], [units, "Time,a1,tacho"], ["Time,a1,tacho", "", units, ""]):
        read = contents(tmp_path / "run.csv", [*header, *rows()])
        assert named(read) == list(zip(["Time", "a1", "tacho"], words, strict=True))


@pytest.mark.parametrize("names", [["Unnamed: 0", "a1", "tacho"], ["Channel: 1", "Channel: 2", "Channel: 3"]])
def test_names_with_colons(tmp_path, names):
    assert named(contents(tmp_path / "run.csv", [",".join(names), *rows()])) == [(name, "") for name in names]


def test_words_in_round_brackets_that_are_no_units_belong_to_the_name(tmp_path):
    read = contents(tmp_path / "run.csv", ["t [s],Accel (left),Accel (right) [g]", *rows()])
    assert named(read) == [("t", "s"), ("Accel (left)", ""), ("Accel (right)", "g")]


@pytest.mark.parametrize(
    ("line", "rate"),
    [
        ("Sample rate,2000", 2000), ("Sampling Frequency (Hz): 25600", 25600), ("# fs = 2000 Hz", 2000),
        ("fs=51.2 kHz", 51200), ("Rate: 2000 Hz", 2000), ("dt,0.0005", 2000), ("dt = 5.0e-4", 2000),
        ("Time interval,0.5,ms", 2000), ("Sample Interval,5.0E-04", 2000), ("Sampling interval [µs]: 500", 2000),
        ("Delta_X,0.0005", 2000), ("Abtastrate: 12,8 kHz", 12800), ("Abtastrate [Hz],2000", 2000),
        ("Sampling rate in Hz,2000", 2000), ("Scan rate: 2000 S/s", 2000), ("Sample rate,2000,Hz", 2000),
        ("% SampFreq: 97656", 97656), ("Samples per second,2000", 2000), ("SR: 48000", 48000),
        ("sample_rate_hz,2000", 2000),
        ("Acquisition rate,2 MS/s", 2e6), ("X increment;0.0005", 2000), ("Time step (s): 0.0005", 2000),
        ('Sample rate,"2,000"', None), ("Filter rate,500", None), ("Frequency: 50 Hz", None),
        ("Line frequency,50", None),
        ("Speed: 1500 rpm", None), ("Cutoff frequency: 5 kHz", None), ("Rate,25", None), ("Sample rate,0", None),
        ("Sample rate,-5", None), ("Sample rate: 25 or 50", None),
    ],
)  # fmt: skip
def test_sampling_rates_that_a_header_states(tmp_path, line, rate):
    read = contents(tmp_path / "run.csv", ["Rig 7", line, "a1,tacho", "g,V", *rows(form="{x:.4f}|{p:.3f}")])
    assert named(read) == [("a1", "g"), ("tacho", "V")]
    assert read.sampling_rate == (None if rate is None else pytest.approx(rate, rel=1e-12))


def test_decimal_commas_in_facts(tmp_path):
    lines = ["dt;0,0005", "a1;tacho", *rows(";", "{x:.4f}|{p:.3f}", decimal=",")]
    read = contents(tmp_path / "run.csv", lines)
    assert (named(read), read.sampling_rate, read.rate_from) == ([("a1", ""), ("tacho", "")], 2000, "dt")


def test_rates_that_contradict_each_other_are_not_taken(tmp_path):
    read = contents(tmp_path / "run.csv", ["fs: 2000 Hz", "Sample rate: 2500 Hz", "a,b,c", *rows()])
    assert read.sampling_rate is None
    assert "fs, Sample rate state different sampling rates, so none was taken" in [note.text for note in read.notes]


@pytest.mark.parametrize("line", ["Speed: 1500 rpm", "RPM,1500", "Drehzahl [U/min]: 1500", "Shaft speed,1500,rev/min"])
def test_speeds_that_a_header_states(tmp_path, line):
    assert contents(tmp_path / "run.csv", [line, "a,b,c", *rows()]).speed_rpm == 1500


FOREIGN = {
    "PicoScope": (
        ["Time,Channel A,Channel B", "(ms),(mV),(V)", "", *rows(form="{ms:.4f}|{x:.4f}|{p:.3f}")],
        [("Time", "ms"), ("Channel A", "mV"), ("Channel B", "V")], None,
    ),
    "Keysight": (
        ["x-axis,1,2", "second,Volt,Volt", *rows()],
        [("x-axis", "second"), ("1", "Volt"), ("2", "Volt")], None,
    ),
    "Rigol": (
        ["X,CH1,CH2,Start,Increment", "Sequence,Volt,Volt,-1.20e-02,5.00e-04", *rows(form="{i}|{x:.2e}|{p:.2e}||")],
        [("X", "Sequence"), ("CH1", "Volt"), ("CH2", "Volt")], 2000,
    ),
    "Siglent": (
        ["Record Length,Analog:60", "Sample Interval,Analog:5E-04", "Vertical Units,CH1:V", "Source,CH1", "Second,Volt",
         *rows(form="{t:.6f}|{x:.4f}")],
        [("Second", "Second"), ("Volt", "Volt")], 2000,
    ),
    "Tektronix MSO": (
        ["Model,MSO64", "Label,CH1", "Waveform Type,ANALOG", "Horizontal Units,s", "Sample Interval,5e-4",
         "Record Length,60", "Zero Index,30", "Vertical Units,V", ",", "Labels,", "TIME,CH1",
         *rows(form="{t:.6f}|{x:.4f}")],
        [("TIME", ""), ("CH1", "")], 2000,
    ),
    "Tektronix TDS": (
        [f"{fact},{row}," for fact, row in zip(
            ["Record Length,6.0e+01,", "Sample Interval,5.0e-04,", "Trigger Point,3.0e+01,", "Source,CH1,",
             "Vertical Units,V,", "Horizontal Units,s,", *[",,"] * (N - 6)],
            rows(form="{t:.6f}|{x:.4f}"), strict=True)],
        [("column4", ""), ("column5", "")], 2000,
    ),
    "catman": (
        ["CATMAN 5.1", "Date: 01.02.2024\tTime: 10:00:00", "Zeit  1 - Standardmessrate\tMX840_CH 1\tMX840_CH 2",
         "s\tm/s²\tV", "Rate: 2000 Hz\tRate: 2000 Hz\tRate: 2000 Hz", *rows("\t")],
        [("Zeit  1 - Standardmessrate", "s"), ("MX840_CH 1", "m/s²"), ("MX840_CH 2", "V")], 2000,
    ),
    "Dewesoft": (
        ["Dewesoft X", "Sample rate: 2000 Hz", "Start time: 01.02.2024 10:00:00", "", "Time (s);AI 1 (m/s2);AI 2 (V)",
         *rows(";")],
        [("Time", "s"), ("AI 1", "m/s2"), ("AI 2", "V")], 2000,
    ),
    "OROS": (
        ["Title\tRun 3", "Sampling frequency\t2000\tHz", "Name\tCh1\tCh2", "Unit\tg\tV", *rows("\t")],
        [("column1", ""), ("Ch1", "g"), ("Ch2", "V")], 2000,
    ),
    "HBM": (
        ["Messung;Prüfstand 3", "Kanal:;a1;Drehzahlgeber", "Einheit:;m/s²;V", *rows(";", decimal=",")],
        [("column1", ""), ("a1", "m/s²"), ("Drehzahlgeber", "V")], None,
    ),
    "NI": (
        ["waveform\t[0]\t[1]", "t0\t01.02.2024 10:00:00,000\t01.02.2024 10:00:00,000", "delta t\t0,000500\t0,000500",
         "", "time[0]\tY[0]\tY[1]", *rows("\t", decimal=",")],
        [("time[0]", ""), ("Y[0]", ""), ("Y[1]", "")], 2000,
    ),
    "MATLAB writetable": (["Time,a1_g,tacho", *rows()], [("Time", ""), ("a1_g", ""), ("tacho", "")], None),
    "pandas index": (
        [",time,a1,tacho", *rows(form="{i}|{t:.6f}|{x:.4f}|{p:.3f}")],
        [("column1", ""), ("time", ""), ("a1", ""), ("tacho", "")], None,
    ),
    "pandas without names": (["0,1,2", *rows()], [("0", ""), ("1", ""), ("2", "")], None),
    "pandas index without names": (
        [",0,1,2", *rows(form="{i}|{t:.6f}|{x:.4f}|{p:.3f}")],
        [("column1", ""), ("0", ""), ("1", ""), ("2", "")], None,
    ),
    "R write.csv": (
        ['"","time","a1"', *rows(form='"{i}"|{t:.6f}|{x:.4f}')], [("column1", ""), ("time", ""), ("a1", "")], None
    ),
    "R write.table": (
        ['"time" "a1"', *rows(" ", '"{i}"|{t:.6f}|{x:.4f}')], [("column1", ""), ("time", ""), ("a1", "")], None
    ),
    "columns of blanks": (
        ["Time (s)   Front bearing (g)   Tacho (V)", *rows("   ")],
        [("Time", "s"), ("Front bearing", "g"), ("Tacho", "V")], None,
    ),
    "spreadsheet": (["sep=;", "Time;a1;tacho", *rows(";")], [("Time", ""), ("a1", ""), ("tacho", "")], None),
}  # fmt: skip


@pytest.mark.parametrize("program", FOREIGN)
def test_headers_of_programs(tmp_path, program):
    lines, names, rate = FOREIGN[program]
    read = contents(tmp_path / "run.csv", lines)
    assert named(read) == names
    assert read.sampling_rate == rate
    assert {column.values.size for column in read.columns} == {N}


@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(tmp_path, coding):
    lines = ["Zeit [s];Getriebegehäuse [m/s²];Temperatur [°C]", *rows(";", decimal=",")]
    read = contents(tmp_path / "run.csv", lines, coding=coding)
    assert named(read) == [("Zeit", "s"), ("Getriebegehäuse", "m/s²"), ("Temperatur", "°C")]
    assert any(note.code == "text-encoding" for note in read.notes) == (coding == "cp1252")


def test_fields_in_quotes_hold_separators_and_line_ends(tmp_path):
    read = contents(tmp_path / "run.csv", ['"Time","Accel, ""left""\n[g]","Tacho, raw (V)"', *rows()])
    assert named(read) == [("Time", ""), ('Accel, "left"', "g"), ("Tacho, raw", "V")]
    assert_array_equal(read.columns[1].values, X)


@pytest.mark.parametrize("lines", [201, 1500])
def test_long_headers(tmp_path, lines):
    header = [f"Setting {i}: {i % 7}" for i in range(lines)]
    read = contents(tmp_path / "run.csv", [*header, "Time,a1,tacho", "s,g,V", *rows()])
    assert named(read) == THREE
    assert_array_equal(read.columns[1].values, X)


def test_a_header_of_another_width_is_refused(tmp_path):
    with pytest.raises(InputError, match="line 2 names 2 columns, the lines below have 3 numbers"):
        contents(tmp_path / "run.csv", ["rig 7", "left,right", *rows()])


@pytest.mark.parametrize(
    ("interval", "percent"),
    [("0.000039", 1.3), ("3.91E-5", 0.13), ("0.0391 ms", 0.13), ("0.00005", None), ("3.90625e-05", None),
     ("0.000022675737", None)],
)  # fmt: skip
def test_an_interval_of_few_digits_is_a_doubt(tmp_path, interval, percent):
    """39 us may be 25 600 Hz or 25 641 Hz; 50 us are 20 000 Hz."""
    read = contents(tmp_path / "run.csv", [f"dt: {interval}", "a1;tacho", *(row.split(";", 1)[1] for row in rows(";"))])
    found = [note.values["uncertainty"] for note in read.notes if note.code == "rounded-interval"]
    assert found == ([] if percent is None else [pytest.approx(percent / 100, rel=0.02)])
