"""Unit: TOML files are read within limits; each offence is one line that names the file."""

import os
import re

import pytest

from sigdb.core.errors import InputError
from sigdb.core.toml_files import check_file, read_toml


def test_read_toml_returns_the_tables(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('name = "ä"\n[table]\nx = 1.5\n', encoding="utf-8")
    assert read_toml(path) == {"name": "ä", "table": {"x": 1.5}}


def test_read_toml_of_a_missing_file_names_it(tmp_path):
    with pytest.raises(InputError, match=r"absent\.toml: no such file"):
        read_toml(tmp_path / "absent.toml")


def test_read_toml_of_a_folder_says_it_cannot_be_read(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(InputError, match=r"folder\.toml: cannot be read \("):
        read_toml(tmp_path / "folder.toml")


def test_read_toml_of_other_encodings_names_the_byte(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes(b'n = "\xe4"')
    with pytest.raises(InputError, match=r"latin\.toml: not UTF-8 text \(byte 5\)"):
        read_toml(path)


def test_read_toml_of_malformed_text_names_the_place(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("a = 1\nb = = 2\n")
    with pytest.raises(InputError, match=r"bad\.toml: not valid TOML: .*line 2"):
        read_toml(path)


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("drive = motor", 'text needs quotes: drive = "motor"'),
        ("path=rigs/my-rig.toml # mine", 'text needs quotes: path = "rigs/my-rig.toml"'),
        ("names = [left, right]", 'text needs quotes: "left"'),
        ("spare = True", "write true"),
        ("diameter = 0,7", "numbers have a decimal point: diameter = 0.7"),
        ('path = "C:\\Users\\rig.toml"', "write the folders of a path with /, or put it in single quotes"),
    ],
)
def test_read_toml_of_a_usual_mistake_names_the_remedy(tmp_path, line, remedy):
    path = tmp_path / "bad.toml"
    path.write_text(f"a = 1\n{line}\n", encoding="utf-8")
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}: not valid TOML: .*; {re.escape(remedy)}$"):
        read_toml(path)


def test_read_toml_of_an_endless_number_is_one_line(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("a = " + "9" * 5000)
    with pytest.raises(InputError, match=r"bad\.toml: not valid TOML: a number has more than 4300 digits$"):
        read_toml(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"x = {10**19}", r"x: a whole number of TOML is at most 9223372036854775807"),
        (f"[a]\nx = [1, -{10**30}]", r"a\.x: a whole number of TOML is at most"),
        ("x = 0x" + "F" * 20, r"x: a whole number of TOML is at most"),
        ("x = " + "[" * 100 + "]" * 100, r"tables or arrays are nested more than 64 deep"),
        ("x = " + "[" * 3000 + "]" * 3000, r"tables or arrays are nested more than 64 deep"),
        ("x = " + "{a=" * 900 + "1" + "}" * 900, r"tables or arrays are nested more than 64 deep"),
        (".".join("a" * 20_000) + " = 1", r"line 1: a key has more than 64 parts"),
        ("\n[" + '."b"' * 100 + "]", r"line 2: a key has more than 64 parts"),
    ],
)
def test_what_no_reader_holds_is_one_line(tmp_path, text, message):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"^\S*bad\.toml: {message}.*$"):
        read_toml(path)


def test_rows_of_many_fractions_are_no_keys(tmp_path):
    path = tmp_path / "table.toml"
    path.write_text("x = [\n" + "0.5, " * 200 + "\n]\ny = '" + "." * 200 + "'\n")
    assert read_toml(path) == {"x": [0.5] * 200, "y": "." * 200}


def test_pipes_devices_and_names_that_no_file_has_are_refused(tmp_path):
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    for path in (pipe, tmp_path / "zero.toml"):
        if not path.exists():
            path.symlink_to(os.devnull)
        with pytest.raises(InputError, match=rf"{path.name}: not a regular file but a pipe or a device"):
            read_toml(path)
    with pytest.raises(InputError, match=r"'a.x00b\.toml' cannot be the name of a file"):
        read_toml(type(tmp_path)("a\0b.toml"))


def test_a_file_beyond_its_size_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "large.toml"
    path.touch()
    os.truncate(path, 20_000_000)
    with pytest.raises(InputError, match=r"large\.toml: 20000000 bytes are more than the 16000000"):
        read_toml(path)
    check_file(path)
