"""Unit: the names and units of columns of times, in many languages and spellings."""

import pytest

from sigdb.recording.files.time_names import seconds_of, time_name


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("Time/s", "s"), ("t / s", "s"), ("t[s]", "s"), ("Zeit in s", "s"), ("time-ms", "ms"), ("time_in_ms", "ms"),
        ("timeMs", "ms"), ("time(ms)", "ms"), ("t_us", "us"), ("tms", "ms"), ("timestamp_ns", "ns"), ("t (µs)", "μs"),
        ("Elapsed Time (s)", "s"), ("Time [sec]", "sec"), ("Temps (ms)", "ms"), ("Время, мс", "мс"), ("时间(s)", "s"),
        ("group/time", ""), ("run.time_s", "s"), ("Time stamp", ""), ("Time - Plot 0", ""), ("TIME", ""),
        ("Uhrzeit", ""), ("时间", ""), ("시간", ""), ("समय", ""), ("Czas", ""), ("Aika", ""), ("Zaman", ""),
        ("tiempo", ""), ("tijd", ""), ("TimeMilliSeconds", "milliseconds"), ("Elapsed NanoSeconds", "nanoseconds"),
        ("Time (Micro Seconds)", "microseconds"), ("Time [uSec]", "usec"), ("ms_time", "ms"), ("Time ms CH1", "ms"),
        ("Time [ms] rel", "ms"), ("milliseconds since epoch", "milliseconds"), ("usTime", "us"),
    ],
)  # fmt: skip
def test_names_of_times(name, unit):
    meaning = time_name(name)
    assert (meaning.kind, meaning.unit) == ("time", unit)


@pytest.mark.parametrize("name", ["t", "T", "Tempo", "Tid", "Čas", "Temps", "hora", "run.t"])
def test_short_names_may_be_other_quantities(name):
    assert time_name(name).kind == "short"


@pytest.mark.parametrize(
    "name", ["x-axis (s)", "seconds", "sec", "ms", "X", "X_Value", "x axis", "sampletime", "t_vib"]
)
def test_names_that_a_ramp_makes_times(name):
    assert time_name(name).kind == "perhaps"


@pytest.mark.parametrize(
    "name", ["", "#", "Unnamed: 0", "index", "No.", "Nr", "Sample", "Sample Number", "i", "№", "idx"]
)
def test_names_of_counts(name):
    assert time_name(name).kind == "count"


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("T", "degC"), ("Time", "V"), ("t", "N m"), ("X", "g"), ("n", "1/min"), ("speed", "min^-1"), ("v in m/s", ""),
        ("omega_rad_s", ""), ("min", ""), ("a1", ""), ("tacho", ""), ("column1", ""), ("data1", ""), ("rpm", ""),
        ("f", "Hz"), ("angle", "°"), ("load", "%"), ("Time x1e-3 s", ""), ("10^-3 s", ""), ("Time (x10e-6 s)", ""),
        ("Time in 1/100 s", ""), ("t*1000", ""), ("t 10⁻³ s", ""),
    ],
)  # fmt: skip
def test_other_names_and_units(name, unit):
    assert time_name(name, unit).kind == "other"


@pytest.mark.parametrize("name", ["Time1 (s)", "t1 s", "Time - Plot 2 s", "Time 10 [s]"])
def test_numbers_of_channels_are_no_factors(name):
    assert time_name(name).unit == "s"


@pytest.mark.parametrize("unit", ["s", "[s]", "(s)", "sec.", "Seconds", "in s", "Sek.", "秒", "S", "1", ""])
def test_units_of_a_second(unit):
    assert seconds_of(unit) == 1


@pytest.mark.parametrize(
    ("unit", "seconds"),
    [("ms", 1e-3), ("µs", 1e-6), ("μs", 1e-6), ("ns", 1e-9), ("min", 60), ("h", 3600), ("d", 86400)],
)
def test_other_units_of_time(unit, seconds):
    assert seconds_of(unit) == seconds


@pytest.mark.parametrize(
    "unit", ["g", "m/s", "m/s^2", "1/s", "1/min", "s^-1", "V", "degC", "°C", "%", "hh:mm:ss", "Hz"]
)
def test_units_of_other_quantities(unit):
    assert seconds_of(unit) is None
