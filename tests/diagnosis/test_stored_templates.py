"""Stored templates for a diagnosis: beside each, those of machines with the nuisances that its database states."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import sigdb
from sigdb.diagnosis.change import templates as of_change
from sigdb.diagnosis.change.templates import MOST_MACHINES, Templates
from sigdb.diagnosis.rig_templates import Source
from sigdb.pipeline import load_recipe
from sigdb.recognition import TemplateBank
from sigdb.sweep import run

RECIPE = """
[sweep]
rig = "spur-test-rig"
gear = "pinion"
seed = 5
specimens = 2
healthy = 20

[[sweep.grid]]
tooth = 1
stiffness_loss = [0.2, 0.4]

[measurement]
averages = 96
snr_db = 10.0
index_error = 1e-6

[signature]
samples_per_tooth = 32
"""
NUISANCES = """
[nuisance]
gain_db = 2.0
path_db = 3.0
path_deg = 20.0
index_error = 2e-6
torque = 0.2
"""
KINDS = ("gain", "path", "index errors", "torque")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    def make(more):
        folder = tmp_path_factory.mktemp("stored")
        (folder / "stored.toml").write_text(RECIPE + more, encoding="utf-8")
        run(load_recipe(folder / "stored.toml").plan(), folder / "signatures", jobs=1)
        return sigdb.open(folder / "signatures")

    return make


@pytest.fixture(scope="module")
def with_nuisances(made):
    return made(NUISANCES)


def stored(database):
    point = database.templates().iloc[0]
    teeth = int(point["teeth"])
    return Templates.stored(
        TemplateBank.of(database), speed_rpm=point["speed_rpm"], torque=point["torque"], teeth=teeth
    )


def test_without_nuisances_each_template_stands_alone(made):
    templates = stored(made(""))
    assert templates.healthy.shape[0] == 1
    assert list(templates.severity["stiffness_loss"]) == [0.2, 0.4]


def test_beside_each_template_stand_those_of_other_machines(with_nuisances):
    templates = stored(with_nuisances)
    machines = MOST_MACHINES + 1
    assert templates.healthy.shape[0] == machines
    assert list(templates.severity["stiffness_loss"]) == [0.2, 0.4] * machines
    tsa = with_nuisances.templates()["tsa"].iloc[0]
    assert_allclose(templates.healthy, np.tile(np.fft.rfft(tsa), (machines, 1)), atol=1e-2 * np.std(tsa))


def test_they_vary_as_the_stored_modes_say(with_nuisances, monkeypatch):
    """The mean square of many draws at each order is that of the modes of gain, path and torque, by their weights.

    Index errors are of the gear, so that its healthy recordings hold them. At the mesh harmonics nothing changes.
    """
    monkeypatch.setattr(of_change, "MOST_MACHINES", 4000)
    monkeypatch.setattr(of_change, "_MOST_STORED", 10**6)
    templates = stored(with_nuisances)
    changes = (templates.spectra - np.tile(templates.spectra[:2], (4001, 1))).reshape(4001, 2, -1)[1:]
    orders = np.arange(changes.shape[2])
    at_mesh = np.minimum(orders % templates.teeth, -orders % templates.teeth) <= 1
    assert not changes[:, :, at_mesh].any()
    table = with_nuisances.templates()
    for place, (_, row) in enumerate(table[table["stiffness_loss"] > 0].iterrows()):
        modes = row["nuisance_modes"].reshape(templates.samples, -1)
        each = np.split(
            np.abs(np.fft.rfft(modes, axis=0)) ** 2, np.cumsum(row["nuisance_counts"].astype(int))[:-1], axis=1
        )
        of = dict(zip(KINDS, (columns.sum(axis=1) for columns in each), strict=True))
        # Each nuisance alone and all together, in the stated size or a third of it; index errors alone change nothing.
        alone, together = 0.6 / 4, 0.1
        size = (1 + 1 / 9) / 2
        weight = size * (alone + together) / (3 * alone + together)
        expected = np.where(at_mesh, 0.0, weight * (of["gain"] + of["path"] + of["torque"]))
        strong = expected > 1e-3 * expected.max()
        assert_allclose((np.abs(changes[:, place]) ** 2).mean(axis=0)[strong], expected[strong], rtol=0.25)


def test_the_assumption_names_them(made, with_nuisances):
    rig = sigdb.load_transmission("spur-test-rig")
    sentences = []
    for database in (made(""), with_nuisances):
        source = Source(rig=rig, described=True, bank=TemplateBank.of(database))
        at = {"speed_rpm": rig.operating.speed_rpm, "torque": rig.operating.torque}
        simulated = source.templates(gear="pinion", sensor=None, channel="", samples_per_tooth=32, **at)
        sentences.append(simulated.assumed[0])
    assert "machines" not in sentences[0]
    drawn = f"or those of one of {MOST_MACHINES} machines with the nuisances that their recipe states."
    assert sentences[1].endswith(drawn)
