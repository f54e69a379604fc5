"""A database of some hundred rows of one tooth count, and one of two."""

import pytest

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 6
healthy = 25
draws = 8

[[sweep.grid]]
tooth = [1, 2, 3]
stiffness_loss = [0.2, 0.4]
{more}

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""


def made(folder, more=""):
    (folder / "recipe.toml").write_text(RECIPE.format(more=more), encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")


@pytest.fixture(scope="session")
def database(tmp_path_factory):
    return made(tmp_path_factory.mktemp("one"))


@pytest.fixture(scope="session")
def two_counts(tmp_path_factory):
    return made(tmp_path_factory.mktemp("two"), "averages = 108\npinion.teeth = [11, 12]")
