"""Validation: the stored numbers of known rigs, which the page shows, hold what is asked of the intervals."""

import json
from pathlib import Path

import pytest

from sigdb.transmission import load_transmission

GUIDE = Path(__file__).parents[2] / "docs" / "guide"
TABLES = json.loads((GUIDE / "identification.json").read_text(encoding="utf-8"))["tables"]


def test_intervals_of_twins_hold_their_numbers():
    (pooled,), numbers = TABLES["twins, pooled"], TABLES["twins, by number"]
    assert 0.90 <= pooled["coverage"] <= 0.99
    assert pooled["coverage"] == pytest.approx(sum(row["inside"] for row in numbers) / (40 * len(numbers)))
    assert all(row["of"] == 40 and row["inside"] >= 33 for row in numbers)


def test_the_published_bearings_are_inside_or_not_identified():
    rig = load_transmission("friswell-turbogenerator")
    rows = TABLES["published rotor"]
    assert len(rows) == 8
    for row in rows:
        _, name, _, axis = row["number"].split(".")
        assert row["published"] == rig.bearings[name].stiffness[int(axis)]
        assert row["inside"] == (row["low"] <= row["published"] <= row["high"])
        assert row["inside"] or not row["identified"]


def test_derivatives_in_closed_form_agree_and_take_less_time():
    for row in TABLES["derivatives"]:
        assert row["ratio"] == pytest.approx(row["difference_ms"] / row["closed_form_ms"])
        assert row["ratio"] > 2
        assert row["greatest_deviation"] < 1e-3


def test_the_page_shows_every_table():
    page = (GUIDE / "identification.md").read_text(encoding="utf-8")
    assert all(f"{{stored}} identification.json {title}\n" in page for title in TABLES)
