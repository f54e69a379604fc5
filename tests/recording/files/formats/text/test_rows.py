"""Unit: which lines of a text are rows of its table, and what is left out or refused."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from sigdb.core.errors import InputError
from sigdb.recording import RecordingSettings
from sigdb.recording.files.formats.text.reader import read_text

N = 60
T = np.arange(N) / 2000
X = np.round(np.random.default_rng(5).normal(size=N) * 20, 3)
ROWS = [f"{t:.6f},{x:.3f},{i % 3}.5" for i, (t, x) in enumerate(zip(T, X, strict=True))]
HEAD = ["time [s],a1 [g],tacho [V]"]
OVERLOADS = ["OVLD", "OVERLOAD", "###", "#####", "Over", "---", "∞", "-∞", "OL", "O.L", "Overflow", "overrange", "OVR",
             "clipped", "#NUM!", "broken", "9.9E+37", "-9.9e37"]  # fmt: skip


def contents(path, lines, **options):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_text(path, RecordingSettings(**options))


def names(read):
    return [column.name for column in read.columns]


def notes(read):
    return " | ".join(note.text for note in read.notes)


@pytest.mark.parametrize("mark", OVERLOADS)
@pytest.mark.parametrize("row", [0, 1, 50, N - 1])
def test_overloads_are_refused_wherever_they_stand(tmp_path, mark, row):
    lines = list(ROWS)
    lines[row] = f"{T[row]:.6f},{mark},0.5"
    with pytest.raises(InputError, match=rf"line {row + 2}, column (2 \(a1\)|a1): "):
        contents(tmp_path / "run.csv", [*HEAD, *lines])


@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("mark", ["OVLD", "###", "---", "Over"])
@pytest.mark.parametrize("head", [HEAD, [*HEAD, ""], [], ["Time,a,b", "s,g,V"]])
def test_overloads_in_the_first_rows_are_no_header(tmp_path, mark, count, head):
    lines = [f"{t:.6f},{mark},0.5" for t in T[:count]] + ROWS[count:]
    with pytest.raises(InputError, match=rf"line {len(head) + 1}, column 2.*'{mark}' marks an overload"):
        contents(tmp_path / "run.csv", [*head, *lines])


def test_a_row_of_nothing_but_overloads_is_no_header(tmp_path):
    with pytest.raises(InputError, match=r"line 2, column 1 \(a1\): 'OVLD' marks an overload"):
        contents(tmp_path / "run.csv", ["a1,a2", "OVLD,OVLD", *(f"{x},{-x}" for x in X)])


@pytest.mark.parametrize(
    ("footer", "lines"),
    [
        (["End of data"], 1), (["", "End of data"], 1), (["Mean,0.1,0.5", "Max,3.2,1.5"], 2), (["# end"], 1),
        (["", "Mean,0.1,0.5", "Max,3.2,1.5", "Min,-3.2,0.5"], 3), (["", "0.1,0.2,0.3"], 1), (["*** End ***"], 1),
        (["", "Statistics", "", "Mean: 0.1", "RMS: 20.1"], 4), (["Total samples: 60"], 1),
    ],
)  # fmt: skip
def test_footers_are_left_out(tmp_path, footer, lines):
    read = contents(tmp_path / "run.csv", [*HEAD, *ROWS, *footer])
    assert_array_equal(read.columns[1].values, X)
    (note,) = [note for note in read.notes if note.code == "footer-left-out"]
    assert note.values["lines"] in (lines, lines + 1)


@pytest.mark.parametrize("between", [[], [""], ["", ""], ["", "Run 2"]])
@pytest.mark.parametrize("head", [HEAD, []])
def test_several_tables_are_refused(tmp_path, between, head):
    if not head and not between:
        return
    with pytest.raises(InputError, match=r"line 6\d.*(several tables|a second table may follow)"):
        contents(tmp_path / "run.csv", [*HEAD, *ROWS, *between, *head, *ROWS])


def test_a_blank_line_after_each_row(tmp_path):
    lines = [part for row in ROWS for part in (row, "")]
    assert_array_equal(contents(tmp_path / "run.csv", [*HEAD, *lines]).columns[1].values, X)


@pytest.mark.parametrize(
    ("word", "held"),
    [("OK", "words"), ("TRUE", "true and false"), ("false", "true and false"), ("gear in", "words"), ("Über", "words")],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_columns_of_words_are_left_out(tmp_path, word, held, separator, place):
    fields = [row.split(",")[:2] for row in ROWS]
    lines = [separator.join([*row[:place], word, *row[place:]]) for row in fields]
    head = ["time", "a1"]
    head.insert(place, "state")
    read = contents(tmp_path / "run.csv", [separator.join(head), *lines])
    assert names(read) == ["time", "a1"]
    assert_array_equal(read.columns[1].values, X)
    assert f"state holds {held} and was left out" in notes(read)


@pytest.mark.parametrize("row", [0, 7, 40])
def test_a_column_of_comments_is_left_out(tmp_path, row):
    lines = [f"{line},bump" if i == row else f"{line}," for i, line in enumerate(ROWS)]
    read = contents(tmp_path / "run.csv", ["time,a1,tacho,Comment", *lines])
    assert names(read) == ["time", "a1", "tacho"]
    assert_array_equal(read.columns[1].values, X)
    assert "Comment holds words and was left out" in notes(read)


@pytest.mark.parametrize(
    ("mark", "decimal", "separator"),
    [(",", ".", ";"), (",", ".", "\t"), ("'", ".", ";"), ("\u2019", ".", "\t"), (".", ",", ";"), (" ", ",", ";"),
     ("\u202f", ",", "\t"), ("'", ".", ",")],
)  # fmt: skip
def test_marks_of_thousands_are_removed_where_they_are_certain(tmp_path, mark, decimal, separator):
    values = np.round(np.linspace(-2_345_678.5, 3_456_789.25, N), 2)
    texts = [f"{x:,.2f}".replace(",", "!").replace(".", decimal).replace("!", mark) for x in values]
    read = contents(tmp_path / "run.csv", [f"n{separator}a1", *(f"{i}{separator}{x}" for i, x in enumerate(texts))])
    assert_array_equal(read.columns[1].values, values)
    assert "marks of thousands were removed from numbers" in notes(read)


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("mark", [",", "."])
def test_marks_that_may_be_decimal_signs_are_refused(tmp_path, separator, mark):
    lines = [f"{i}{separator}{900 + 37 * i:,d}".replace(",", mark) for i in range(N)]
    with pytest.raises(
        InputError, match=rf"line 5: '1\{mark}011' has a mark of thousands or a decimal sign; give decimal"
    ):
        contents(tmp_path / "run.csv", ["n" + separator + "a1", *lines])
    read = contents(tmp_path / "run.csv", ["n" + separator + "a1", *lines], decimal="," if mark == "." else ".")
    assert_array_equal(read.columns[1].values, 900 + 37 * np.arange(N))


def test_quoted_numbers_with_marks_of_thousands(tmp_path):
    lines = [f'{i},"{900 + 37.5 * i:,.1f}"' for i in range(N)]
    assert_array_equal(contents(tmp_path / "run.csv", ["n,a1", *lines]).columns[1].values, 900 + 37.5 * np.arange(N))


def test_quoted_numbers_with_decimal_commas(tmp_path):
    lines = [f'"{t:.4f}","{x:.3f}"'.replace(".", ",") for t, x in zip(T, X, strict=True)]
    assert_array_equal(contents(tmp_path / "run.csv", ['"t","a1"', *lines]).columns[1].values, X)


@pytest.mark.parametrize("names_too", [False, True])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_separators_at_line_ends(tmp_path, names_too, separator):
    lines = [line.replace(",", separator) + separator for line in ROWS]
    read = contents(tmp_path / "run.csv", ["time,a1,tacho".replace(",", separator) + separator * names_too, *lines])
    assert names(read) == ["time", "a1", "tacho"]


@pytest.mark.parametrize(("front", "header"), [(";", "id;wave"), (",", "id,wave"), (";", None), ("\t", "id\twave")])
@pytest.mark.parametrize("name", ["{}", "b{}", "2024-03-01_{}"])
def test_records_along_lines(tmp_path, front, header, name):
    waves = np.round(np.random.default_rng(1).normal(size=(7, 500)), 4)
    lines = [name.format(k + 17) + front + ";".join(f"{x:.4f}" for x in wave) for k, wave in enumerate(waves)]
    read = contents(tmp_path / "run.csv", [*([header] if header else []), *lines])
    assert names(read) == [name.format(k + 17) for k in range(7)]
    assert_array_equal(np.stack([column.values for column in read.columns]), waves)
    assert "7 records, each a line of an identifier and samples" in notes(read)


def test_a_record_with_a_word_is_refused(tmp_path):
    wave = ["0.5"] * 200
    lines = [f"{k};" + ";".join(wave) for k in range(5)]
    lines[3] = "3;" + ";".join([*wave[:99], "OVLD", *wave[100:]])
    with pytest.raises(InputError, match="line 5: 'OVLD' of the record is not a number"):
        contents(tmp_path / "run.csv", ["id;wave", *lines])


def test_a_header_of_numbers_is_no_row(tmp_path):
    read = contents(tmp_path / "run.csv", ["x-axis,1,2", "second,Volt,Volt", *ROWS])
    assert {column.values.size for column in read.columns} == {N}


def test_exponents_of_fortran(tmp_path):
    lines = [f"{t:.6e} {x:.6e}".replace("e", "D") for t, x in zip(T, X, strict=True)]
    assert_array_equal(contents(tmp_path / "run.txt", lines).columns[1].values, X)


@pytest.mark.parametrize(
    ("head", "first"), [([], "2000"), (["a1"], "60"), (["a1,a2"], "2000,2000"), (["a1,a2", "g,g"], "2000,4000")]
)
def test_whole_numbers_above_decimal_ones_are_no_samples(tmp_path, head, first):
    lines = [",".join([f"{x:.3f}"] * (1 + first.count(","))) for x in X]
    with pytest.raises(InputError, match=rf"line {len(head) + 1}, .* may state a rate or a number of samples; remove"):
        contents(tmp_path / "run.csv", [*head, first, *lines])


@pytest.mark.parametrize("form", ["{:.3f} g", "({:.3f})", "{:.3f}+0.1i", "0x{:.0f}A", "{:.3f}?"])
def test_numbers_in_other_forms_are_refused(tmp_path, form):
    lines = [f"{t},{form.format(abs(x))}" for t, x in zip(T, X, strict=True)]
    with pytest.raises(InputError, match=r"column 2 \(a1\) holds .* and the like, which are not plain numbers"):
        contents(tmp_path / "run.csv", ["t,a1", *lines])


def test_minus_signs_of_typesetting(tmp_path):
    lines = [f"{t},{x}".replace("-", "\N{MINUS SIGN}") for t, x in zip(T, X, strict=True)]
    assert_array_equal(contents(tmp_path / "run.csv", ["t,a1", *lines]).columns[1].values, X)
