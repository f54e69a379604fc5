"""Databases that are read, each made once, and copies that a test may damage."""

import shutil

import pytest

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

SMALL = '''# Two sensors, 11 and 12 teeth, a case without contact; "quotes", \\ and """three""", µm.
[sweep]
rig = "nasa-spiral-bevel"
seed = 9
specimens = 4
healthy = 30

[[sweep.grid]]
tooth = "all"
stiffness_loss = [0.2, 0.4]
averages = 108
pinion.teeth = [12, 11]

[[sweep.grid]]
tooth = 2
stiffness_loss = 0.5
phase_shift_deg = 4.0
index_error = 2e-6  # three of four specimens take the mesh out of contact
operating.torque = 100.0

[signature]
samples_per_tooth = 32
'''

PARTS = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 7
specimens = 115

[[sweep.grid]]
pinion.teeth = 11
tooth = "all"
damaged_teeth = [1, 2]
stiffness_loss = [0.1, 0.2]
averages = 36

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""


@pytest.fixture(scope="session")
def make(tmp_path_factory):
    def make_database(text):
        folder = tmp_path_factory.mktemp("database")
        (folder / "recipe.toml").write_text(text, encoding="utf-8")
        recipe = load_recipe(folder / "recipe.toml")
        run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
        return folder / "signatures"

    return make_database


@pytest.fixture(scope="session")
def recipe_text():
    return SMALL


@pytest.fixture(scope="session")
def folder(make):
    """A few hundred rows with two sensors, two tooth counts and failed rows, in two row groups of signals."""
    return make(SMALL)


@pytest.fixture(scope="session")
def database(folder):
    return sigdb.open(folder)


@pytest.fixture
def copy(folder, tmp_path):
    """A copy of ``folder`` that may be damaged."""
    return shutil.copytree(folder, tmp_path / "copy")


@pytest.fixture(scope="session")
def parts_text():
    return PARTS


@pytest.fixture(scope="session")
def parts_folder(make):
    """5060 rows in three parts of 2048."""
    return make(PARTS)


@pytest.fixture
def parts_copy(parts_folder, tmp_path):
    return shutil.copytree(parts_folder, tmp_path / "parts")
