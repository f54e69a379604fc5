"""The table of nuisances in the guide: it is made of the stored one, which is that of a card."""

import importlib
import json

import pytest


@pytest.fixture(scope="module")
def made():
    return importlib.import_module("nuisances")


def test_the_guide_holds_the_stored_table(made):
    guide = made.GUIDE.read_text(encoding="utf-8")
    assert made.BEGIN in guide
    assert guide == made.with_table(guide, json.loads(made.STORED.read_text(encoding="utf-8")))


def test_a_card_has_a_table_of_robustness(made):
    table = "| disturbance | right |\n| --- | --- |\n| a gain | 0.5 |"
    card = f"# Card\n\n## Robustness\n\nWords.\n\n{table}\n\n## Criteria\n| a | b |\n"
    assert made.card_table(card) == [{"disturbance": "a gain", "right": "0.5"}]
