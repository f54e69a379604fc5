"""A database and a model of version 0.1.0, as it stood before its modules moved, stay readable."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.core import DatabaseError
from sigdb.database import database_card
from sigdb.pipeline import load_recipe
from sigdb.sweep import repair, run, verify

MADE = Path(__file__).with_name("version_0_1")
COUNT = "select count(*) from features"


@pytest.fixture
def signatures(tmp_path):
    return Path(shutil.copytree(MADE / "signatures", tmp_path / "signatures"))


def test_the_database_opens_and_answers(signatures):
    db = sigdb.open(signatures)
    cases = db.cases()
    assert (len(cases), sorted(cases["tooth"].unique())) == (9, [0, 3])
    assert db.signals(cases["id"])["tsa"].shape == (9, 12 * 32)
    assert len(db.sql("select id, fm4 from features")) == 9


def test_nothing_is_wrong_with_the_database(signatures):
    assert verify(signatures, deep=True) == ()


def test_its_recipe_gives_the_same_hash_and_rows_that_differ_by_the_damping_alone(signatures, tmp_path):
    """The rotors' damping acted on absolute motion then; index errors and noise are the same draws."""
    recipe = load_recipe(MADE / "recipe.toml")
    run(recipe.plan(), tmp_path / "again", recipe=recipe.text, jobs=1)
    old, new = sigdb.open(signatures), sigdb.open(tmp_path / "again")
    assert new.manifest.hash == old.manifest.hash
    ids = old.cases()["id"]
    found, before = np.array(new.signals(ids)["tsa"]), np.array(old.signals(ids)["tsa"])
    np.testing.assert_allclose(found, before, rtol=0, atol=2e-3 * np.ptp(before))


def test_templates_of_other_equations_are_not_added(signatures):
    """Its templates are not made again for a comparison either, but a damaged one is found and not replaced."""
    file = signatures / "templates" / "part-00000.parquet"
    file.write_bytes(file.read_bytes()[:-1] + b"?")
    with pytest.raises(DatabaseError, match=r"templates are of an earlier version .* equations differ; go on with"):
        repair(signatures, jobs=1)
    assert (signatures / "receipts" / "templates-00000.json").exists()
    (signatures / "receipts" / "templates-00000.json").unlink()
    recipe = load_recipe(MADE / "recipe.toml")
    with pytest.raises(DatabaseError, match="equations differ"):
        run(recipe.plan(), signatures, recipe=recipe.text, jobs=1)


def test_its_card_has_no_mesh_force(signatures):
    assert database_card(sigdb.open(signatures))["checks"]["min_mesh_force"] is None


def test_its_rows_have_a_status_without_a_code(signatures):
    """Reasons of rows without a result are then grouped by the sentence; here there is no such row."""
    database = sigdb.open(signatures)
    assert set(database.cases()["status"]) == {"ok"}
    assert "status_code" not in database.dataset("features").schema.names
    assert database_card(database)["statuses"] == []


def test_the_model_loads_and_answers_as_when_it_was_saved(signatures):
    model = sigdb.load_model(MADE / "location")
    assert (model.target, model.learner) == ("location", "lda")
    assert {"lda", "templates", "nearest_template", "fm4", "majority"} <= set(model.estimators)


@pytest.mark.parametrize("command", [["card"], ["verify", "--deep"], ["match", "--id", "3"], ["query", COUNT]])
def test_commands_take_the_database(signatures, command):
    result = CliRunner().invoke(cli, [command[0], str(signatures), *command[1:]])
    assert (result.exit_code, result.exception) == (0, None), result.output
