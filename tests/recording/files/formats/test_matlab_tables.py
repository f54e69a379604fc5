"""Verification: tables and timetables of MATLAB in both kinds of MAT-files."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_recording

X = np.sin(np.arange(40.0))
NEW_YEAR = 1_704_067_200_000.0  # 2024-01-01, ms after 1970


def texts(recording):
    return [note.text for note in recording.notes]


@pytest.fixture(params=["5", "5 compressed", "7.3"])
def save(request, matlab):
    if request.param == "7.3":
        return matlab.save_73
    return lambda *given, **options: matlab.save_5(*given, compressed="c" in request.param, **options)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mat"


@pytest.mark.parametrize("version", [2, 3, 4])
def test_columns_of_a_table_with_their_units(matlab, save, path, version):
    objects = matlab.Objects()
    pair = np.stack([X, X**2], 1)
    table = matlab.table(objects, {"t": np.arange(40) / 200, "a1": X, "xy": pair}, units=["s", "m/s^2", "g"])
    save(path, {"run": table}, objects, version=version)
    read = read_recording(path)
    assert [(one.name, one.unit) for one in read.channels] == [
        ("run.a1", "m/s^2"), ("run.xy1", "g"), ("run.xy2", "g"),
    ]  # fmt: skip
    assert [one.sampling_rate for one in read.channels] == pytest.approx([200.0] * 3)
    assert_array_equal(read.channel("run.xy2").samples, X**2)


def test_a_timetable_with_a_rate(matlab, save, path):
    objects = matlab.Objects()
    times = matlab.regular(matlab.duration(objects, [0.5]), matlab.duration(objects, [1 / 12_800]), 12_800.0)
    save(path, {"tt": matlab.timetable(objects, {"a1": X, "a2": X + 1}, times, units=["g", ""])}, objects)
    read = read_recording(path)
    assert [(one.name, one.unit, one.sampling_rate) for one in read.channels] == [
        ("tt.a1", "g", 12_800.0), ("tt.a2", "", 12_800.0),
    ]  # fmt: skip


def test_a_timetable_with_a_step(matlab, save, path):
    objects = matlab.Objects()
    times = matlab.regular(matlab.datetime(objects, [NEW_YEAR]), matlab.duration(objects, [0.002]))
    save(path, {"tt": matlab.timetable(objects, {"a1": X}, times)}, objects)
    assert read_recording(path).channels[0].sampling_rate == pytest.approx(500.0, rel=1e-12)


@pytest.mark.parametrize("dimension", ["Time", "Date", "x"])
def test_times_of_rows(matlab, save, path, dimension):
    objects = matlab.Objects()
    times = matlab.duration(objects, 3 + np.arange(40) / 1600)
    save(path, {"tt": matlab.timetable(objects, {"a1": X}, times, dimension=dimension)}, objects)
    read = read_recording(path)
    assert [one.name for one in read.channels] == ["tt.a1"]
    assert read.channels[0].sampling_rate == pytest.approx(1600, rel=1e-9)


def test_dates_of_rows_keep_their_microseconds(matlab, save, path):
    """A date has 0.2 us in its real part; MATLAB keeps the rest in the imaginary part."""
    objects = matlab.Objects()
    exact = np.arange(40) * 1000 / 51_200
    whole = NEW_YEAR + exact
    dates = matlab.datetime(objects, whole + 1j * (exact - (whole - NEW_YEAR)))
    save(path, {"tt": matlab.timetable(objects, {"a1": X}, dates)}, objects)
    read = read_recording(path)
    assert read.channels[0].sampling_rate == pytest.approx(51_200, rel=1e-9)
    assert "tt: its times are in s after 2024-01-01T00:00:00" in texts(read)


def test_durations_and_texts_outside_tables(matlab, save, path):
    objects = matlab.Objects()
    save(path, {"t": matlab.duration(objects, np.arange(40) / 250), "a1": X[:, None],
                "about": matlab.string(objects, "grün")}, objects)  # fmt: skip
    read = read_recording(path)
    assert [(one.name, one.sampling_rate) for one in read.channels] == [("a1", pytest.approx(250))]
    assert_allclose(read.channels[0].samples, X)


def test_columns_that_are_no_numbers_are_named(matlab, save, path):
    objects = matlab.Objects()
    states = objects.add("categorical", {"codes": np.ones((40, 1), np.uint8)})
    table = matlab.table(objects, {"state": states, "a1": X, "words": ["a"] * 40}, rows=40)
    when = objects.add("calendarDuration", {"components": {"months": np.array([[3.0]])}})
    times = matlab.regular(matlab.duration(objects, [0]), when)
    save(path, {"run": table, "tt": matlab.timetable(objects, {"a": X}, times), "state": states}, objects)
    read = read_recording(path, sampling_rate=10)
    assert [one.name for one in read.channels] == ["run.a1"]
    assert {
        "run.state is a categorical, which cannot be read; save its columns as arrays of numbers",
        "run.words is a cell array, which cannot be read; save its columns as arrays of numbers",
        "state is a categorical, which cannot be read; save its columns as arrays of numbers",
        "tt is a timetable, which cannot be read (it holds a calendarDuration without numbers of seconds); save its "
        "columns as arrays of numbers",
    } <= set(texts(read))


def test_rows_that_are_missing_are_refused(matlab, save, path):
    objects = matlab.Objects()
    save(path, {"run": matlab.table(objects, {"a1": X}, rows=41)}, objects)
    with pytest.raises(InputError, match=r"its column a1 has the shape \(40, 1\), the table has 41 rows"):
        read_recording(path, sampling_rate=10)


def test_objects_that_are_not_in_the_file(matlab, save, path):
    objects = matlab.Objects()
    lost = matlab.table(objects, {"a1": X})
    lost.words[4] = 7
    save(path, {"run": lost}, objects)
    with pytest.raises(InputError, match=r"run is a table, which cannot be read \(its number is not in the file\)"):
        read_recording(path, sampling_rate=10)


def test_a_later_version_of_the_format_is_not_guessed(matlab, save, path):
    objects = matlab.Objects()
    table = matlab.table(objects, {"a1": X})
    objects.wrapped = lambda version: [
        np.frombuffer(objects.metadata(9), np.uint8)[:, None], np.zeros((0, 0)), *objects.cells, [], [], [{}, {}]
    ]  # fmt: skip
    save(path, {"run": table}, objects)
    with pytest.raises(InputError, match="or of a version that is not known"):
        read_recording(path, sampling_rate=10)
