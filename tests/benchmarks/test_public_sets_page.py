"""The page on results of public sets: it is made of the stored results, and says which adapters were tried."""

import importlib
from collections import Counter

import pytest

from sigdb.public_sets import load_public_set, public_set_names


@pytest.fixture(scope="module")
def made():
    return importlib.import_module("public_sets_page")


def test_the_page_is_made_of_the_stored_results(made):
    assert made.PAGE.read_text(encoding="utf-8") == made.page(made.stored_results())


def test_only_adapters_that_were_tried_have_stored_results(made):
    for name, results in made.stored_results().items():
        assert name == results["name"]
        assert load_public_set(name).tried
        assert results["verdicts"] == Counter(answer["verdict"] for answer in results["answers"])


@pytest.mark.parametrize("name", public_set_names())
def test_each_adapter_is_listed_as_tried_or_not(name, made):
    (line,) = [line for line in made.page({}).splitlines() if line.startswith(f"| `{name}` |")]
    tried = load_public_set(name).tried
    assert line.endswith(f"| {tried or 'not tried'} | none |")
    assert ("not tried" in line) == (tried == "")


def results(**parts):
    empty = {"recordings": 0, "missing": [], "changed": []}
    return {"name": "seu", "folder": empty, "rows": [], "indicators": [], "answers": [], "verdicts": {}, **parts}


def test_results_of_a_set(made):
    answers = [
        {"file": "a.csv", "channel": "x", "state": "Miss", "expected": "damage", "answer": answer, "verdict": verdict}
        for answer, verdict in (("one tooth", "right"), ("no change", "wrong"), ("one tooth", "right"))
    ]
    areas = [
        {"sensor": sensor, "indicator": "fm4", "healthy": 3, "damaged": 2, "area": area}
        for sensor, area in (("x", 0.75), ("y", 1.0))
    ]
    rows = [{"state": "Miss", "health": "damaged", "status_code": "ok", "recordings": 2, "rows": 4}]
    folder = {"recordings": 5, "missing": ["1 of 5 files b.csv"], "changed": []}
    counted = {"right": 2, "wrong": 1}
    text = made.page({"seu": results(folder=folder, rows=rows, indicators=areas, answers=answers, verdicts=counted)})
    assert "Recordings: 5. Missing: `1 of 5 files b.csv`. Other files than the published ones: none." in text
    assert "| Miss | damaged | ok | 2 | 4 |" in text
    assert "| indicator | x | y |\n|---|---|---|\n| `fm4` | 0.75 | 1.00 |" in text
    assert "Recordings labelled damaged and healthy: 2 and 3." in text
    assert "Answers: 3, 2 right, 1 wrong, 0 abstained, 0 not known." in text
    assert "| a.csv | x | Miss | damage | no change | wrong |" in text
    assert "would be right here too" not in text
    assert "Licence of the recordings: no page could be cited." in text


def test_a_set_without_healthy_recordings_or_diagnoses(made):
    text = made.page({"seu": results()})
    assert "No sensor has recordings of both labels." in text
    assert "No recording was diagnosed." in text


def test_right_answers_without_damage_are_said_to_be_easy(made):
    row = {"file": "a.csv", "channel": "x", "state": "h", "expected": "none", "answer": "no change", "verdict": "right"}
    text = made.page({"seu": results(answers=[row], verdicts={"right": 1})})
    assert "a method that never finds any would be right here too" in text
