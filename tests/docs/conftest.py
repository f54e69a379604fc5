"""A folder as a reader of the pages has it: the recipes, and a small database with a location model."""

import shutil
from pathlib import Path

import pytest

from sigdb.database import open as open_database
from sigdb.pipeline import load_recipe, train_model
from sigdb.sweep import run

ROOT = Path(__file__).parents[2]

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
gear = "pinion"
seed = 1
specimens = 3
healthy = 10

[[sweep.grid]]
tooth = "all"
stiffness_loss = 0.4

[measurement]
averages = 102
snr_db = -10.0
index_error = 2e-6

[signature]
sensors = ["pinion-vertical"]

[recognition]
learner = "lda"
folds = 3
"""


@pytest.fixture(scope="session")
def made(tmp_path_factory, few_trees, few_tries):
    """The folder, made once."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "pipelines", folder / "pipelines")
    shutil.copytree(ROOT / "data" / "transmissions", folder / "data" / "transmissions")
    recipe = folder / "small.toml"
    recipe.write_text(RECIPE, encoding="utf-8")
    quick = folder / "data" / "quick"
    loaded = load_recipe(recipe)
    run(loaded.plan(), quick / "signatures", recipe=loaded.text, jobs=1)
    recipe.unlink()
    train_model(
        open_database(quick / "signatures"),
        "location",
        quick / "location",
        command="sigdb train data/quick/signatures --target location --out data/quick/location",
    )
    return folder


@pytest.fixture
def reader(made, tmp_path, monkeypatch):
    """A copy of the folder as the current directory, so that no page sees what another one wrote."""
    folder = tmp_path / "reader"
    shutil.copytree(made, folder)
    monkeypatch.chdir(folder)
    return folder
