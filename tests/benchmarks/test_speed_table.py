"""The README's table of speed is that of the stored numbers."""

import importlib
from dataclasses import replace

import pytest


@pytest.fixture(scope="module")
def made():
    return importlib.import_module("speed_table")


def test_the_readme_has_the_table_of_the_stored_numbers(made):
    readme = made.README.read_text(encoding="utf-8")
    assert readme.count(made.BEGIN) == readme.count(made.END) == 1
    assert readme == made.with_table(readme)


def test_a_row_that_is_not_stored_is_not_passed_over(made, monkeypatch):
    nobody = replace(made.LINES[0], peer={**made.LINES[0].peer, "by": "nobody"})
    monkeypatch.setattr(made, "LINES", (nobody,))
    with pytest.raises(ValueError, match="not enough values to unpack"):
        made.table()
