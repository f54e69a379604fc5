"""Unit: tables of text: whole in a pipe, within the width of a terminal, and nothing is lost in either."""

import io

import pytest

from sigdb.report.text_table import Terminal, TextTable, value_text

TABLE = TextTable(
    ("name", "value", "what it is"),
    [["[bold]one", "1.5", "a sentence that is far longer than a narrow terminal is wide"], ["two", "-12.25e-3", "x"]],
)
WIDE = TextTable([f"column {i}" for i in range(12)], [[f"{i}.{j}" for i in range(12)] for j in range(3)])


def words(text):
    return sorted(text.split())


def test_a_pipe_gets_one_line_a_row_without_styles():
    head, first, second = TABLE.text(indent=2).splitlines()
    assert head == "  name           value  what it is"
    assert first == "  [bold]one        1.5  a sentence that is far longer than a narrow terminal is wide"
    assert second == "  two        -12.25e-3  x"


@pytest.mark.parametrize("width", [1, 20, 30, 50, 80])
def test_no_word_and_no_digit_is_lost_in_a_narrow_terminal(width):
    for table in (TABLE, WIDE):
        text = table.text(Terminal(width=width))
        assert set(words(text)) == set(words(table.text()))


@pytest.mark.parametrize("styled", [False, True])
def test_lines_fit_the_terminal(styled):
    for table in (TABLE, WIDE):
        lines = table.text(Terminal(width=48)).splitlines()
        assert max(map(len, lines)) <= 48


def test_columns_that_do_not_fit_follow_in_blocks_that_begin_with_the_first_one():
    blocks = WIDE.text(Terminal(width=48)).split("\n\n")
    assert len(blocks) == 3
    for block in blocks:
        assert [line.split()[0] for line in block.splitlines()] == ["column", "0.0", "0.1", "0.2"]


def test_a_styled_terminal_gets_bold_headings_and_a_rule():
    head, rule, *rows = TABLE.text(Terminal(width=60, styled=True)).splitlines()
    assert "\x1b[1m" in head
    assert set(rule) == {"─"}
    assert "\x1b" not in "".join(rows)


def test_only_a_terminal_has_a_width(monkeypatch):
    class Screen(io.StringIO):
        def isatty(self):
            return True

    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "33")
    monkeypatch.setenv("TERM", "xterm")
    assert Terminal.of(Screen()) == Terminal(width=33, styled=True)
    assert Terminal.of(io.StringIO()) == Terminal()
    assert Terminal.of(io.BytesIO()) == Terminal()
    monkeypatch.setenv("NO_COLOR", "1")
    assert not Terminal.of(Screen()).styled
    monkeypatch.delenv("NO_COLOR")
    monkeypatch.setenv("TERM", "dumb")
    assert not Terminal.of(Screen()).styled


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "-"),
        (float("nan"), "-"),
        (1.23456789e-9, "1.23457e-09"),
        (10**12 + 1, "1000000000001"),
        (True, "True"),
        ([1.0, None], "[1, -]"),
        (list(range(768)), "[0, 1, 2, ... 768 in all]"),
    ],
)
def test_values_as_text(value, text):
    assert value_text(value) == text
