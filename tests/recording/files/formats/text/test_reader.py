"""Unit: tables of numbers in text, as recorders, spreadsheets and MATLAB write them."""

import gzip

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import read_recording

X = np.random.default_rng(4).integers(-999, 999, (40, 3)) / 8


def written(path, separator=",", decimal=".", header=None, ends="\n", coding="utf-8", x=X):
    lines = [separator.join(f"{value:.3f}".replace(".", decimal) for value in row) for row in x]
    path.write_bytes((ends.join([*(header or []), *lines]) + ends).encode(coding))
    return path


def read(path, **options):
    return read_recording(path, **{"sampling_rate": 1000} | options)


def matrix(recording):
    return np.stack([one.samples for one in recording.channels], 1)


@pytest.mark.parametrize("header", [None, ["left,right,tacho"]])
@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "   ", ", ", " ; "])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("ends", ["\n", "\r\n"])
def test_separators_and_decimal_signs_are_found(tmp_path, header, separator, decimal, ends):
    if decimal == "," in separator:
        return
    names = None if header is None else [header[0].replace(",", separator)]
    found = read(written(tmp_path / "run.txt", separator, decimal, names, ends))
    assert_array_equal(matrix(found), X)
    assert [one.name for one in found.channels] == (header or ["column1,column2,column3"])[0].split(",")
    plain = separator.strip(" ") == "," and decimal == "."
    assert any(note.code == "text-format" for note in found.notes) != plain


@pytest.mark.parametrize("coding", ["utf-8-sig", "utf-16", "latin-1"])
def test_codings_of_text(tmp_path, coding):
    found = read(written(tmp_path / "run.csv", header=["größe,b,c"], coding=coding))
    assert_array_equal(matrix(found), X)
    assert found.channels[0].name.startswith("gr")


def test_gzip_in_two_members(tmp_path):
    data = written(tmp_path / "run.csv").read_bytes()
    (tmp_path / "run.csv.gz").write_bytes(gzip.compress(data[:100]) + gzip.compress(data[100:]))
    assert_array_equal(matrix(read(tmp_path / "run.csv.gz")), X)


@pytest.mark.parametrize(
    ("header", "names", "units"),
    [
        (["a [g],b (m/s^2),c"], ["a", "b", "c"], ["g", "m/s^2", ""]),
        (["a,b,c", "g,g,V"], ["a", "b", "c"], ["g", "g", "V"]),
        (["# rig 7", "", "# a,b,c"], ["a", "b", "c"], ["", "", ""]),
        (['"a","b","c"'], ["a", "b", "c"], ["", "", ""]),
        (["Rig;7", "made by hand"], ["column1", "column2", "column3"], ["", "", ""]),
    ],
)
def test_headers(tmp_path, header, names, units):
    found = read(written(tmp_path / "run.csv", header=header))
    assert [one.name for one in found.channels] == names
    assert [one.unit for one in found.channels] == units
    assert_array_equal(matrix(found), X)


def test_a_last_separator_is_no_column(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("a,b,\n" + "".join(f"{i % 7},{i % 3},\n" for i in range(30)), encoding="utf-8")
    assert [one.name for one in read(path).channels] == ["a", "b"]


@pytest.mark.parametrize("given", [".", ","])
def test_two_integers_or_one_decimal_number(tmp_path, given):
    path = tmp_path / "run.csv"
    path.write_text("".join(f"{i % 7},{i % 5}\n" for i in range(40)), encoding="utf-8")
    with pytest.raises(InputError, match="two integers or one number with a decimal comma; give decimal="):
        read(path)
    found = read(path, decimal=given)
    assert len(found.channels) == {".": 2, ",": 1}[given]
    assert found.channels[0].samples[6] == {".": 6, ",": 6.1}[given]


@pytest.mark.parametrize(
    ("line", "text", "told"),
    [
        (20, "1.0,2.0", "line 21 has 2 columns, others have 3; mend or remove it"),
        (20, "1.0,2.0,3.0,4.0", "line 21 has 4 columns, others have 3"),
        (1, "1.0,2.0", "line 2 has 2 numbers, later lines have 3"),
        (20, "1.0,two,3.0", "line 21, column 2 \\(b\\): 'two' is not a number; mend it, or leave it empty"),
        (20, "1.0,2\N{DEGREE SIGN},3.0", "line 21, column 2 .b.: '2\N{DEGREE SIGN}' is not a number"),
        (20, "1.0,inf,3.0", "channel b: sample 19 is infinite"),
    ],
)
def test_lines_that_are_not_rows(tmp_path, line, text, told):
    path = written(tmp_path / "run.csv", header=["a,b,c"])
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([*lines[:line], text, *lines[line + 1 :]]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=told):
        read(path)


def test_a_last_line_that_was_not_finished_is_left_out(tmp_path):
    path = written(tmp_path / "run.csv")
    path.write_bytes(path.read_bytes()[:-9])
    found = read(path)
    assert_array_equal(matrix(found), X[:-1])
    assert [note.text for note in found.notes] == ["the last line is not whole and was left out"]


def test_a_whole_last_line_needs_no_line_end(tmp_path):
    path = written(tmp_path / "run.csv")
    path.write_bytes(path.read_bytes()[:-1])
    assert_array_equal(matrix(read(path)), X)


def test_a_wrong_separator_is_an_error(tmp_path):
    with pytest.raises(
        InputError, match=r"no table of numbers in its first 41 lines; the first is '56.500;110.625;95.250'"
    ):
        read(written(tmp_path / "run.csv", separator=";"), separator="\t")


def test_a_header_of_another_width_is_an_error(tmp_path):
    with pytest.raises(InputError, match="line 1 names 2 columns, the lines below have 3 numbers"):
        read(written(tmp_path / "run.csv", header=["a,b"]))


def test_clock_times_are_left_out(tmp_path):
    path = tmp_path / "run.csv"
    rows = (f"2024-03-01 10:00:0{i % 10}.25,{i % 7},{i % 3}\n" for i in range(30))
    path.write_text("when,a,b\n" + "".join(rows), encoding="utf-8")
    found = read(path)
    assert [one.name for one in found.channels] == ["a", "b"]
    told = "when holds dates or clock times and was left out: it falls at line 12"
    assert told in [note.text for note in found.notes]


@pytest.mark.parametrize("word", ["", "NaN", "nan", "NA", "null", "#N/A"])
def test_words_for_missing_numbers(tmp_path, word):
    path = written(tmp_path / "run.csv", header=["a,b,c"], x=np.repeat(X, 5, 0))
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[50] = f"1.0,{word},3.0"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = read(path)
    assert found.channel("b").samples[49] == (found.channel("b").samples[48] + found.channel("b").samples[50]) / 2
    assert "b: 1 missing samples in 1 gaps" in found.notes[0].text


def test_more_columns_than_a_recording_has(tmp_path):
    with pytest.raises(InputError, match="holds 2000 columns, more than 1024; samples of a channel run down a column"):
        read(written(tmp_path / "run.csv", x=np.zeros((2, 2000))))
