"""Documentation: the worked example of the guide is of the rig, the targets and the numbers that it states."""

import json
import re
from pathlib import Path

import pytest

import sigdb
from sigdb.identification import load_targets
from sigdb.transmission import load_transmission

GUIDE = Path(__file__).parents[2] / "docs" / "guide"
DOCUMENT = json.loads((GUIDE / "fitted_rig.json").read_text(encoding="utf-8"))
TABLES, SEED = DOCUMENT["tables"], 20260


@pytest.fixture(scope="module")
def rig():
    return load_transmission("spur-test-rig")


def test_the_stated_targets_fit_the_rig(rig):
    targets = load_targets(GUIDE / "fitted_rig_targets.toml")
    targets.check(rig)
    assert [(target.speed_rpm, target.held_out) for target in targets.harmonics] == [
        (1200.0, False), (1800.0, False), (1500.0, True)
    ]  # fmt: skip
    labels = [number.label for number in targets.quantities if number.held_out]
    assert [row["quantity"] for row in TABLES["held out"]] == labels


def test_the_stored_truth_is_the_drawn_rig_and_inside_means_inside(rig):
    (drawn,) = sigdb.ensemble(rig, 1, rng=SEED).values
    assert {row["number"]: row["truth"] for row in TABLES["numbers"]} == drawn
    for row in TABLES["numbers"]:
        assumption = rig.assumptions[row["number"]]
        assert (row["low"], row["high"]) == (assumption.low, assumption.high)
        assert row["inside"] == (row["interval_from"] <= row["truth"] <= row["interval_to"])
        assert row["identified"] == (row["width"] <= 0.8)
    first, *others, total = TABLES["rigs"]
    assert first["inside"] == sum(row["inside"] for row in TABLES["numbers"])
    assert first["identified"] == sum(row["identified"] for row in TABLES["numbers"])
    assert first["expected"] == pytest.approx(11 * (first["of"] - 1) / (first["of"] + 1))
    assert total["inside"] == sum(row["inside"] for row in (first, *others))


def test_the_page_shows_every_table():
    page = " ".join((GUIDE / "known_and_assumed.md").read_text(encoding="utf-8").split())
    assert all(f"{{stored}} fitted_rig.json {title} " in page for title in TABLES)
    first, *_ = TABLES["rigs"]
    assert f"--members {first['of']} " in page
    assert re.findall(r"(\d+) of the (\d+) intervals hold the truth, where (\d+) % would be ([\d.]+)", page) == [
        (str(first["inside"]), str(first["numbers"]), "85", f"{first['expected']:.1f}")
    ]
