"""Unit: a database's card holds its numbers, as pandas counts them, and says what it is not for."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.core.errors import DatabaseError
from sigdb.database import database_card
from sigdb.pipeline import load_recipe
from sigdb.report import database_card_markdown
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 5
specimens = 3
healthy = 4

[[sweep.grid]]
operating.torque = [300.0, 356.05]
tooth = [2, 7]
stiffness_loss = [0.2, 0.4]

[[sweep.grid]]
tooth = 5
pattern = "pitted"

[[sweep.grid]]
tooth = 5
stiffness_loss = 0.5
index_error = 2e-4  # takes the mesh out of contact

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""


@pytest.fixture(scope="module")
def recipe(tmp_path_factory):
    path = tmp_path_factory.mktemp("card") / "recipe.toml"
    path.write_text(RECIPE, encoding="utf-8")
    return load_recipe(path)


@pytest.fixture(scope="module")
def folder(recipe, tmp_path_factory):
    folder = tmp_path_factory.mktemp("card") / "signatures"
    run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
    return folder


@pytest.fixture(scope="module")
def card(folder):
    return database_card(sigdb.open(folder))


def test_the_counts(card, folder):
    rows = sigdb.open(folder).features()
    failed = rows["status"] != "ok"
    assert failed.any()
    assert card["rows"] == len(rows)
    assert card["healthy"] == (rows["tooth"] == 0).sum()
    assert card["failed"] == failed.sum() == sum(one["rows"] for one in card["statuses"])
    assert card["contact_loss"] == rows["contact_loss"].fillna(False).astype(bool).sum()
    assert card["specimens"] == 3
    assert card["templates"] == len(sigdb.open(folder).templates())
    assert card["patterns"] == ["pitted"]
    assert card["bytes"] == sum(path.stat().st_size for path in folder.rglob("*.parquet"))


def test_the_axes(card):
    axes = {one["name"]: one for one in card["axes"]}
    assert axes["torque"] == {"name": "torque", "unit": "N m", "values": 2, "least": 300.0, "greatest": 356.05}
    assert (axes["tooth"]["least"], axes["tooth"]["greatest"], axes["tooth"]["values"]) == (0, 7, 4)
    assert axes["index_error"]["greatest"] == 2e-4


def test_the_indicators(card, folder):
    rows = sigdb.open(folder).cases("status = 'ok'")
    (fm4,) = (one for one in card["indicators"] if one["name"] == "fm4")
    for kind, some in (("healthy", rows[rows["tooth"] == 0]), ("damaged", rows[rows["tooth"] > 0])):
        np.testing.assert_allclose(fm4[kind], np.quantile(some["fm4"].astype(float), [0.05, 0.5, 0.95]), rtol=1e-6)


def test_the_page(card):
    page = database_card_markdown(card, title="A small database")
    assert page.startswith("# A small database\n")
    assert "Not for: deciding about a machine." in page
    assert "The grid coverage is not estimated: run `sigdb coverage`." in page
    assert f"{card['failed']} | without a result" in page
    assert 'pattern = "pitted"' in page


def test_the_command(folder, card, tmp_path):
    shown = CliRunner().invoke(cli, ["card", str(folder), "--format", "json"])
    assert json.loads(shown.stdout) == card
    written = CliRunner().invoke(cli, ["card", str(folder), "--title", "T", "--out", str(tmp_path / "card.md")])
    assert written.stdout == f"{tmp_path / 'card.md'}: written\n"
    assert (tmp_path / "card.md").read_text(encoding="utf-8") == database_card_markdown(card, title="T")


def test_the_card_as_json_has_no_nan(folder, card, monkeypatch):
    """An indicator without a denominator has no quantile; JSON has no NaN."""
    without = card | {"indicators": [{"name": "fm4", "unit": "-", "healthy": [np.nan] * 3, "damaged": None}]}
    monkeypatch.setattr("sigdb.database.database_card", lambda database: without)
    shown = CliRunner().invoke(cli, ["card", str(folder), "--format", "json"])
    read = json.loads(shown.stdout, parse_constant=pytest.fail)
    assert read["indicators"] == [{"name": "fm4", "unit": "-", "healthy": [None] * 3, "damaged": None}]


def test_an_unfinished_database_has_no_card(folder, recipe, tmp_path):
    run(recipe.plan(), tmp_path / "db", recipe=recipe.text, jobs=1)
    (tmp_path / "db" / "receipts" / "rows-00000.json").unlink()
    with pytest.raises(DatabaseError, match=r"has 0 of \d+ rows; finish the sweep first"):
        database_card(sigdb.open(tmp_path / "db"))


def test_the_card_of_a_database_of_patterns_only(tmp_path):
    """Their rows have no value of a damage's own columns, so that these are no axes."""
    path = tmp_path / "recipe.toml"
    text = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 5
specimens = 1

[[sweep.grid]]
tooth = [5, 7]
pattern = "pitted"

[sweep.patterns]
pitted = [{ stiffness_loss = 0.3 }, {}, { stiffness_loss = 0.1 }]

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""
    path.write_text(text, encoding="utf-8")
    recipe = load_recipe(path)
    run(recipe.plan(), tmp_path / "signatures", recipe=recipe.text, jobs=1)
    facts = database_card(sigdb.open(tmp_path / "signatures"))
    names = {axis["name"] for axis in facts["axes"]}
    assert "tooth" in names
    assert names.isdisjoint({"stiffness_loss", "phase_shift_deg", "loss_extent"})
    assert facts["patterns"] == ["pitted"]
    assert "`tooth`" in database_card_markdown(facts, title="Patterns")
