"""A small database with the operating points, noise and damages of the recipe of the reference models."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

REFERENCE = Path(__file__).parents[2] / "pipelines" / "reference.toml"
JOINT = ("speed_rpm", "torque", "snr_db")


def operating_points():
    """Joint points of the reference recipe, one row each, as its plan has them."""
    plan = load_recipe(REFERENCE).plan()
    return plan.table_of(np.arange(0, plan.rows, 1000))[list(JOINT)].drop_duplicates()


def small_recipe(*, seed, specimens, tooth, healthy):
    """The reference recipe at its own points, with other specimens and some of the teeth, as TOML."""
    recipe = tomllib.loads(REFERENCE.read_text(encoding="utf-8"))
    points = operating_points()
    (grid,) = recipe["sweep"]["grid"]
    kept = {name: grid[name] for name in ("damaged_teeth", "phase_shift_deg", "stiffness_loss")}
    operating = {name: points[name].tolist() for name in ("speed_rpm", "torque")}
    table = {"operating": operating, "snr_db": points["snr_db"].tolist()}
    recipe["sweep"] |= {"seed": seed, "specimens": specimens, "healthy": healthy}
    recipe["sweep"]["grid"] = [kept | {"tooth": tooth, "table": table}]
    return tomli_w.dumps(recipe)


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def fresh(tmp_path_factory):
    """Six pairs of gears that no model has seen; as many healthy rows for a damaged one as the reference has."""
    folder = tmp_path_factory.mktemp("fresh")
    text = small_recipe(seed=2001, specimens=6, tooth=[3], healthy=5)
    (folder / "recipe.toml").write_text(text, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "signatures")
