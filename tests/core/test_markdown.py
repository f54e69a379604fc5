"""Unit: tables in Markdown."""

from sigdb.core import markdown_table


def test_a_table_has_a_head_a_rule_and_rows_and_bars_are_escaped():
    assert markdown_table(("a", "b"), [("1", "|x|")]).splitlines() == ["| a | b |", "| --- | --- |", "| 1 | \\|x\\| |"]


def test_a_table_without_rows_is_its_head():
    assert markdown_table(("a",), []) == "| a |\n| --- |"
