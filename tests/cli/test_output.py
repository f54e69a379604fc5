"""Unit: names, values and messages reach a terminal without control characters; errors are one line."""

import io
import os
import sys

import pytest

from sigdb.cli.main import ExitCode, main
from sigdb.cli.output import VisibleOutput
from sigdb.core import visible_text

ESC = "\x1b"


@pytest.mark.parametrize(
    ("text", "visible"),
    [
        (f"a{ESC}[2Jb", r"a\x1b[2Jb"),
        ("bell\a nul\0 back\b return\r delete\x7f", r"bell\x07 nul\x00 back\x08 return\x0d delete\x7f"),
        ("c1\x9b2J", r"c1\x9b2J"),
        ("right to left\u202e", r"right to left\u202e"),
        ("not UTF-8 \udcff", r"not UTF-8 \udcff"),
        ("Getriebegehäuse µm 時間\tx\n", "Getriebegehäuse µm 時間\tx\n"),
    ],
)
def test_what_steers_a_terminal_is_escaped(text, visible):
    assert visible_text(text) == visible
    stream = io.StringIO()
    VisibleOutput(stream).write(text)
    assert stream.getvalue() == visible


def test_bold_heads_of_tables_stay_and_nothing_else():
    text = f"{ESC}[1mhead{ESC}[0m {ESC}[31mred{ESC}[8mhidden{ESC}[2J"
    assert visible_text(text, emphasis=True) == f"{ESC}[1mhead{ESC}[0m \\x1b[31mred\\x1b[8mhidden\\x1b[2J"


def test_a_table_of_a_query_and_its_heads_are_visible(leave, folder):
    query = f"select 'a' || chr(27) || '[2J' || chr(10) as \"h{ESC}[1m\""
    code, out, err = leave("query", folder / "signatures", query)
    assert (code, err) == (ExitCode.DONE, "")
    assert out.splitlines() == [r"h\x1b[1m", r"a\x1b[2J\n", "(1 rows)"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["query", f"missing{ESC}[2J\nfolder", "select 1"],
        ["query", "{db}", f'select "{ESC}[2J" from cases'],
        ["query", "{db}", "select '\udcff'"],
        ["query", "missing\udcff", "select 1"],
        ["query", "{db}", "update extensions"],
        ["describe", f"{ESC}]0;title\a.toml"],
        ["sweep", f"{ESC}[2J.toml", "--out", "x"],
        ["signature", "missing\udcff.csv", "--teeth", "12"],
    ],
)
def test_bad_input_is_one_visible_line(leave, folder, arguments):
    code, out, err = leave(*(one.format(db=folder / "signatures") for one in arguments))
    assert (code, out) == (ExitCode.BAD_INPUT, "")
    line = err.splitlines()[-1]
    assert err.isascii()
    assert visible_text(err) == err
    assert line.startswith(("sigdb: error: ", "Error: "))


def test_each_of_several_problems_has_a_line(leave, tmp_path):
    path = tmp_path / "recipe.toml"
    path.write_text('[sweep]\nrig = "nasa-spiral-bevel"\nsed = 1\n[[sweep.grid]]\ntooth = "al"\n', encoding="utf-8")
    code, _, err = leave("sweep", path, "--out", tmp_path / "out")
    assert code == ExitCode.BAD_INPUT
    lines = err.splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"sigdb: error: {path}: ") for line in lines)
    assert "tooth = 'al'" in err
    assert "did you mean 'seed'" in err


def test_an_unknown_key_of_a_recipe_is_visible(leave, tmp_path):
    path = tmp_path / "recipe.toml"
    path.write_text('[sweep]\nrig = "nasa-spiral-bevel"\n"key\\u001b[2J" = 1\n', encoding="utf-8")
    code, _, err = leave("sweep", path, "--out", tmp_path / "out")
    assert code == ExitCode.BAD_INPUT
    assert ESC not in err
    assert r"key\x1b[2J" in err


def test_a_closed_output_is_an_error(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["sigdb", "--version"])
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == ExitCode.FAILED
    assert capsys.readouterr().err.startswith("sigdb: error: the standard output is closed")


def test_a_working_directory_that_was_deleted_is_a_sentence(leave, folder, tmp_path, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    monkeypatch.setattr("sigdb.cli.options.places.check_exists", lambda path: None)
    (tmp_path / "gone").rmdir()
    code, _, err = leave("query", "relative", "select 1")
    os.chdir(tmp_path)
    assert code in (ExitCode.BAD_INPUT, ExitCode.FAILED)
    assert err.count("\n") == 1


def test_parquet_is_not_written_to_a_terminal(leave, folder, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    code, out, err = leave("query", folder / "signatures", "select 1", "--format", "parquet")
    assert (code, out) == (ExitCode.BAD_INPUT, "")
    assert "Parquet is binary; give --out FILE" in err
