"""The page on the explorer shows the numbers of its benchmark, for every slider of the page and with its aims."""

import json
import re
from pathlib import Path

import pytest

import sigdb
from sigdb.explorer import LiveRig
from sigdb.explorer.controls import controls_of

GUIDE = Path(__file__).parents[2] / "docs" / "guide"
TABLES = json.loads((GUIDE / "explorer.json").read_text(encoding="utf-8"))["tables"]
PAGE = (GUIDE / "explorer.md").read_text(encoding="utf-8")
SLOWER = {"speed_rpm", "teeth"}


def test_every_slider_was_measured():
    live = LiveRig(sigdb.load_transmission("nasa-spiral-bevel"))
    assert [row["setting"] for row in TABLES["settings"]] == [control.name for control in controls_of(live)]


@pytest.mark.parametrize("row", TABLES["settings"], ids=lambda row: row["setting"])
def test_a_setting_is_within_its_aim_where_the_page_says_so(row):
    assert row["aim_ms"] == (300 if row["setting"] in SLOWER else 50)
    assert row["within_aim"] == (row["p95_ms"] <= row["aim_ms"])
    assert 0 < row["median_to_compute_ms"] < row["median_ms"] <= row["p95_ms"]


def test_the_start_is_within_its_aims_where_the_page_says_so():
    assert [(row["step"], row["aim_s"]) for row in TABLES["start"]] == [
        ("server ready", 3.0),
        ("first paint of the page", 0.5),
    ]
    assert all(row["within_aim"] == (row["s"] <= row["aim_s"]) for row in TABLES["start"])


def test_the_page_shows_both_tables_with_columns_that_they_have():
    shown = dict(re.findall(r"```\{stored\} explorer\.json (\w+)\n(.*?)```", PAGE, flags=re.DOTALL))
    assert shown.keys() == TABLES.keys()
    assert all(set(columns.split()) <= TABLES[title][0].keys() for title, columns in shown.items())
