import pytest
from starlette.testclient import TestClient

import sigdb
from sigdb.explorer import LiveRig
from sigdb.explorer.app import Explorer, explorer_app
from sigdb.pipeline import load_recipe
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "nasa-spiral-bevel"
gear = "pinion"
seed = 1
healthy = 2

[[sweep.grid]]
tooth = "all"
stiffness_loss = [0.2, 0.4]

[measurement]
averages = 102
snr_db = 10.0
"""


@pytest.fixture(scope="session")
def live():
    return LiveRig(sigdb.load_transmission("nasa-spiral-bevel"))


@pytest.fixture(scope="session")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("explorer")
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe = load_recipe(folder / "recipe.toml")
    run(recipe.plan(), str(folder / "db"), recipe=recipe.text, jobs=1)
    return sigdb.open(folder / "db")


@pytest.fixture(scope="session")
def app(live, database):
    explorer = Explorer(live, "nasa-spiral-bevel", database=database)
    yield explorer_app(explorer, token="secret", hosts=("127.0.0.1:8000",))
    explorer.recordings.close()


@pytest.fixture
def client(app):
    return TestClient(app, base_url="http://127.0.0.1:8000", headers={"X-Sigdb-Token": "secret"})
