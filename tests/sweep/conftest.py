"""Plans from the text of a recipe, and small databases, each made once."""

import hashlib
from pathlib import Path

import pytest

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

HEAD = '[sweep]\nrig = "nasa-spiral-bevel"\n'

SMALL = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 3
specimens = 3
draws = 2
healthy = 20

[[sweep.grid]]
tooth = [1, 6, 12]
damaged_teeth = [1, 2]
stiffness_loss = [0.0, 0.4]
phase_shift_deg = [0.0, 2.0]

[[sweep.grid]]
tooth = [12, 3]
pattern = "both"
snr_db = [-10.0, 20.0]
averages = [3, 102]
index_error = [0.0, 5e-6]

[[sweep.grid]]
tooth = 2
stiffness_loss = 0.4
operating.torque = 300.0

[[sweep.grid]]
pinion.teeth = 13
averages = 36
tooth = [1, 13]
damaged_teeth = 2
stiffness_loss = 0.3

[[sweep.grid]]
tooth = 2
stiffness_loss = 0.5
phase_shift_deg = 4.5
operating.torque = 100.0

[sweep.patterns]
both = [{ stiffness_loss = 0.4, loss_extent = 0.2 }, {}, { phase_shift_deg = 1.0 }]

[measurement]
snr_db = 0.0
index_error = 2e-6

[signature]
samples_per_tooth = 32
"""

PARTS = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 7
specimens = {specimens}

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
def recipe_of(tmp_path_factory):
    """A recipe loaded from its text; without ``[sweep]`` the usual head is put before it."""

    def load(text):
        path = tmp_path_factory.mktemp("recipe") / "recipe.toml"
        path.write_text(text if "[sweep]" in text else HEAD + text, encoding="utf-8")
        return load_recipe(path)

    return load


@pytest.fixture(scope="session")
def plan_of(recipe_of):
    return lambda text: recipe_of(text).plan()


@pytest.fixture(scope="session")
def small_plan(plan_of):
    return plan_of(SMALL)


@pytest.fixture(scope="session")
def small_run(small_plan, tmp_path_factory):
    """Folder and summary of a few hundred rows: all kinds of damage, two sensors, 12 and 13 teeth, contact loss."""
    folder = tmp_path_factory.mktemp("small") / "signatures"
    return folder, run(small_plan, folder, recipe=SMALL, jobs=1)


@pytest.fixture(scope="session")
def small(small_run):
    return sigdb.open(small_run[0])


@pytest.fixture(scope="session")
def parts_text():
    """A recipe of 5060 small rows in three parts, and of 2048 rows a part."""
    return PARTS.format(specimens=115)


@pytest.fixture(scope="session")
def parts_plan(plan_of, parts_text):
    return plan_of(parts_text)


@pytest.fixture(scope="session")
def parts_folder(parts_plan, parts_text, tmp_path_factory):
    """The database of ``parts_plan``, made with one job and without interruption."""
    folder = tmp_path_factory.mktemp("parts") / "signatures"
    run(parts_plan, folder, recipe=parts_text, jobs=1)
    return folder


@pytest.fixture(scope="session")
def digests():
    """SHA-256 of every Parquet file below a folder, by path."""

    def of(folder: Path) -> dict[str, str]:
        return {
            str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*.parquet"))
        }

    return of
