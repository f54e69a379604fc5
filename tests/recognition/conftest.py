"""Databases and models of the recognition tests, each made once."""

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import sigdb
from sigdb.pipeline import load_recipe
from sigdb.recognition import RecognitionSettings, train
from sigdb.recognition.estimators import registry
from sigdb.sweep import run

EASY = """
[sweep]
rig = "nasa-spiral-bevel"
gear = "pinion"
seed = {seed}
specimens = {specimens}
healthy = {healthy}

[[sweep.grid]]
{grid}

[measurement]
averages = {averages}
snr_db = {snr_db}
index_error = 1e-6

[signature]
sensors = ["{sensor}"]

[recognition]
folds = 3
learner = "lda"
"""

ALL_TEETH = 'tooth = "all"\ndamaged_teeth = [1, 2]\nphase_shift_deg = [0.0, 2.0]\nstiffness_loss = [0.2, 0.4]'


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def make_database(tmp_path_factory, few_trees):
    def make(*, seed=1, specimens=6, healthy=24, grid=ALL_TEETH, sensor="pinion-vertical", **measured):
        folder = tmp_path_factory.mktemp("database")
        case = {"seed": seed, "specimens": specimens, "healthy": healthy, "grid": grid, "sensor": sensor}
        text = EASY.format(**case, **{"snr_db": 10.0, "averages": 108} | measured)
        (folder / "recipe.toml").write_text(text, encoding="utf-8")
        recipe = load_recipe(folder / "recipe.toml")
        run(recipe.plan(), folder / "signatures", recipe=recipe.text, jobs=1)
        return sigdb.open(folder / "signatures")

    return make


@pytest.fixture(scope="session")
def database(make_database):
    """720 rows: 6 specimens, 24 healthy rows and 8 kinds of damage at 12 teeth each; little noise."""
    return make_database()


@pytest.fixture(scope="session")
def mixed_teeth(make_database):
    """Pinions of 12 and of 13 teeth, another seed than ``database``."""
    grid = 'pinion.teeth = [12, 13]\ntooth = "all"\nstiffness_loss = [0.2, 0.4]'
    return make_database(seed=2, specimens=3, healthy=6, grid=grid)


@pytest.fixture(scope="session")
def many_specimens(make_database):
    """768 rows: 24 specimens, 20 healthy rows and one kind of damage at 12 teeth each."""
    return make_database(seed=3, specimens=24, healthy=20, grid='tooth = "all"\nstiffness_loss = [0.4]')


@pytest.fixture(scope="session")
def rows(database):
    rows = database.features()
    return rows.assign(tsa=list(database.signals(rows["id"].to_numpy())["tsa"]))


@pytest.fixture(scope="session")
def location_model(database):
    return train(database, "location", RecognitionSettings(folds=3, learner="boosting"))


@pytest.fixture(scope="session")
def severity_model(database):
    return train(database, "severity", RecognitionSettings(folds=3, learner="lda"))


@pytest.fixture(scope="session")
def held_out(rows, location_model):
    return rows[~rows["specimen"].isin(location_model.trained_on)]


@pytest.fixture
def without_boosting(monkeypatch):
    """The registry without boosting, which reads what LDA reads and takes longer."""
    module = "sigdb.recognition.estimators.registry"
    monkeypatch.setattr(f"{module}.REGISTRY", tuple(one for one in registry.REGISTRY if one.name != "boosting"))


@pytest.fixture(scope="session")
def turned():
    """Rows of a signal that was turned by so many teeth: tooth t's cells and samples become those of tooth t + j."""

    def turn(rows, j):
        cells = [
            np.roll(np.reshape(flat, (teeth, -1)), j, axis=0).ravel()
            for flat, teeth in zip(rows["wigner_ville"], rows["teeth"], strict=True)
        ]
        tsa = [np.roll(x, j * len(x) // teeth) for x, teeth in zip(rows["tsa"], rows["teeth"], strict=True)]
        return rows.assign(wigner_ville=cells, tsa=tsa)

    return turn
