"""Unit: dates and clock times of a text as seconds since its first row."""

import datetime

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import RecordingSettings
from sigdb.recording.files.formats.text.reader import read_text

N = 60
RATE = 2000
START = datetime.datetime(2024, 3, 13, 10, 0, 59, 990_000, tzinfo=datetime.UTC)
X = np.round(np.sin(np.arange(N)), 4)


def moments(start=START, n=N, step=1 / RATE):
    return [start + datetime.timedelta(microseconds=round(1e6 * step * i)) for i in range(n)]


def contents(path, texts, separator=";", header="when;a1"):
    lines = [header, *(f"{text}{separator}{x:.4f}" for text, x in zip(texts, X, strict=False))]
    path.write_text("\n".join(lines).replace(";", separator) + "\n", encoding="utf-8")
    return read_text(path, RecordingSettings())


def _fraction(form, digits=6):
    return lambda moment: moment.strftime(form).replace("FFF", f"{moment.microsecond:06d}"[:digits])


FORMS = {
    "ISO": _fraction("%Y-%m-%d %H:%M:%S.FFF"),
    "ISO, T": _fraction("%Y-%m-%dT%H:%M:%S.FFF"),
    "ISO, Z": _fraction("%Y-%m-%dT%H:%M:%S.FFFZ"),
    "ISO, offset": _fraction("%Y-%m-%dT%H:%M:%S.FFF+01:00"),
    "ISO, negative offset": _fraction("%Y-%m-%d %H:%M:%S.FFF-05:00"),
    "ISO, offset without colon": _fraction("%Y-%m-%dT%H:%M:%S.FFF+0530"),
    "ISO, comma": _fraction("%Y-%m-%d %H:%M:%S,FFF"),
    "Python": str,
    "ISO, basic": _fraction("%Y%m%dT%H%M%S.FFF"),
    "slashes, year first": _fraction("%Y/%m/%d %H:%M:%S.FFF"),
    "German": _fraction("%d.%m.%Y %H:%M:%S,FFF"),
    "German, short year": _fraction("%d.%m.%y %H:%M:%S.FFF"),
    "British": _fraction("%d/%m/%Y %H:%M:%S.FFF"),
    "American": _fraction("%m/%d/%Y %I:%M:%S.FFF %p"),
    "American, small": lambda moment: _fraction("%m/%d/%Y %I:%M:%S.FFF%p")(moment).lower(),
    "American, points": lambda moment: _fraction("%m/%d/%Y %I:%M:%S.FFF")(moment) + " a.m.",
    "month name": _fraction("%d-%b-%Y %H:%M:%S.FFF"),
    "long month name": _fraction("%d %B %Y %H:%M:%S.FFF"),
    "month first": _fraction("%b %d, %Y %I:%M:%S.FFF %p"),
    "German month": lambda moment: _fraction("%d. MMM %Y %H:%M:%S.FFF")(moment).replace("MMM", "März"),
    "time": _fraction("%H:%M:%S.FFF"),
    "time, comma": _fraction("%H:%M:%S,FFF"),
    "time, noon": _fraction("%I:%M:%S.FFF %p"),
    "time, UTC": _fraction("%H:%M:%S.FFF UTC"),
    "minutes": _fraction("%M:%S.FFF"),
    "minutes, comma": _fraction("%M:%S,FFF"),
    "date without marks": _fraction("%Y%m%d %H:%M:%S.FFF"),
    "day of the year": _fraction("%j:%H:%M:%S.FFF"),
    "year and day": _fraction("%Y:%j:%H:%M:%S.FFF"),
    "pandas duration": _fraction("0 days %H:%M:%S.FFF"),
    "duration of days": _fraction("12 days %H:%M:%S.FFF"),
}


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("form", FORMS)
def test_clock_times_are_seconds_since_the_first_row(tmp_path, form, separator):
    read = contents(tmp_path / "run.csv", map(FORMS[form], moments()), separator)
    assert [(column.name, column.unit) for column in read.columns] == [("when", "s"), ("a1", "")]
    assert_allclose(read.columns[0].values, np.arange(N) / RATE, rtol=0, atol=1e-9)
    assert_array_equal(read.columns[1].values, X)
    (note,) = [note for note in read.notes if note.code == "clock-times"]
    assert FORMS[form](START) in note.text


@pytest.mark.parametrize("form", ["%H:%M:%S:FFF", "%H:%M:%S.FFF", "%Y-%m-%d %H:%M:%S:FFF"])
def test_milliseconds(tmp_path, form):
    texts = map(_fraction(form, 3), moments(step=1e-3))
    assert_allclose(contents(tmp_path / "run.csv", texts).columns[0].values, np.arange(N) / 1000, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("day", "hour"),
    [
        ("%Y-%m-%d", "%H:%M:%S.FFF"), ("%d.%m.%Y", "%H:%M:%S.FFF"), ("%m/%d/%Y", "%I:%M:%S.FFF %p"),
        ("%d-%b-%y", "%H:%M:%S.FFF"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("separator", [",", ";"])
def test_dates_and_times_in_two_columns(tmp_path, day, hour, separator):
    texts = (separator.join(_fraction(form)(moment) for form in (day, hour)) for moment in moments())
    read = contents(tmp_path / "run.csv", texts, separator, header="Date;Time;a1")
    assert [(column.name, column.unit) for column in read.columns] == [("Time", "s"), ("a1", "")]
    assert_allclose(read.columns[0].values, np.arange(N) / RATE, rtol=0, atol=1e-9)


def test_the_end_of_an_hour_and_of_a_day_of_the_year_are_no_leaps(tmp_path):
    end = datetime.datetime(2024, 3, 13, 23, 59, 59, 990_000, tzinfo=datetime.UTC)
    for form in ("%M:%S.FFF", "%j:%H:%M:%S.FFF"):
        read = contents(tmp_path / "run.csv", map(_fraction(form), moments(end)))
        assert_allclose(read.columns[0].values, np.arange(N) / RATE, rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", ["%H:%M:%S.FFF", "%d/%m/%Y %H:%M:%S.FFF", "%m/%d/%Y %I:%M:%S.FFF %p",
                                  "%Y-%m-%d %H:%M:%S.FFF", "%d.%m.%Y %H:%M:%S.FFF", "%I:%M:%S.FFF %p"])  # fmt: skip
@pytest.mark.parametrize("day", [2, 3, 30])
def test_midnight_is_no_leap(tmp_path, form, day):
    start = datetime.datetime(2024, 4, day, 23, 59, 59, 990_000, tzinfo=datetime.UTC)
    read = contents(tmp_path / "run.csv", map(_fraction(form), moments(start)))
    assert_allclose(read.columns[0].values, np.arange(N) / RATE, rtol=0, atol=1e-9)


def test_the_order_of_day_and_month_is_refused_where_it_matters_and_is_not_certain(tmp_path):
    texts = [f"01/{1 + i:02d}/2024 10:00:00" for i in range(12)]
    with pytest.raises(InputError, match="'01/01/2024 10:00:00' may have the day or the month first; write dates as"):
        contents(tmp_path / "run.csv", texts)


def test_offsets_that_change_are_one_time(tmp_path):
    texts = [_fraction("%Y-%m-%dT%H:%M:%S.FFF+00:00")(moment) for moment in moments()]
    later = [_fraction("%Y-%m-%dT%H:%M:%S.FFF+01:00")(moment + datetime.timedelta(hours=1)) for moment in moments()]
    texts[30:] = later[30:]
    assert_allclose(contents(tmp_path / "run.csv", texts).columns[0].values, np.arange(N) / RATE, rtol=0, atol=1e-9)


def test_times_that_elapsed_may_exceed_a_day(tmp_path):
    texts = [f"{23 + i // 30}:59:{i % 30 * 2:02d}.5" for i in range(N)]
    steps = np.diff(contents(tmp_path / "run.csv", texts).columns[0].values)
    assert set(steps) == {2.0, 3542.0}


@pytest.mark.parametrize(
    ("row", "text", "message"),
    [
        (20, "10:61:00.5", "line 22, column when: '10:61:00.5' is no date or clock time like the others"),
        (0, "yesterday", "holds no table|no date or clock time|is not a number"),
        (20, "2024-03-13 10:00:00", "line 22, column when"),
    ],
)
def test_rows_without_a_time_are_refused(tmp_path, row, text, message):
    texts = list(map(FORMS["time"], moments()))
    texts[row] = text
    with pytest.raises(InputError, match=message):
        contents(tmp_path / "run.csv", texts)


def test_a_fraction_behind_a_comma_is_no_column(tmp_path):
    texts = map(_fraction("%Y-%m-%d %H:%M:%S,FFF", 3), moments(step=1e-3))
    path = tmp_path / "run.csv"
    path.write_text("".join(f"{text},{x}\n" for text, x in zip(texts, X, strict=True)), encoding="utf-8")
    with pytest.raises(InputError, match="line 1, column column1: a comma stands before the fraction of a second"):
        read_text(path, RecordingSettings())


@pytest.mark.parametrize(
    ("texts", "reason"),
    [
        ([f"10:00:{59 - i}" for i in range(40)], "it falls at line 3"),
        (["10:00:00"] * 40, "it does not change"),
        ([f"10:00:{i // 10:02d}" for i in range(60)], "its resolution is too coarse for the samples"),
    ],
)
def test_clocks_that_are_no_times_of_samples_are_left_out(tmp_path, texts, reason):
    read = contents(tmp_path / "run.csv", texts)
    assert [column.name for column in read.columns] == ["a1"]
    assert f"when holds dates or clock times and was left out: {reason}" in [note.text for note in read.notes]
