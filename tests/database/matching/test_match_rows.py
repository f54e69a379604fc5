"""Unit: rows of recordings are matched like templates, in one database and across two."""

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import InputError
from sigdb.ingest import IngestSettings, ingest

FS, TEETH = 8192.0, 12


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Two machines, each with teeth of its own, recorded twice."""
    folder = tmp_path_factory.mktemp("rows")
    turns = 20 * np.arange(int(2 * FS)) / FS
    for name, gear, seed in (("m1-a", 1, 1), ("m1-b", 1, 2), ("m2-a", 2, 3), ("m2-b", 2, 4)):
        errors = 1 + 0.3 * np.random.default_rng(gear).normal(size=TEETH)
        x = np.cos(2 * np.pi * TEETH * turns) * errors[(turns * TEETH).astype(int) % TEETH]
        noise = 0.05 * np.random.default_rng(seed).normal(size=x.size)
        np.savez(folder / f"{name}.npz", a1=x + noise, tacho=5.0 * (turns % 1 < 0.1))
    settings = IngestSettings(teeth="12", samples_per_tooth=32, reading={"tacho": "tacho", "sampling_rate": FS})
    ingest(folder, folder / "db", pattern="{machine}-{number}.npz", settings=settings, jobs=1)
    return sigdb.open(folder / "db")


def test_the_nearest_rows_are_of_the_same_machine(measured):
    rows = measured.cases().set_index("id")
    for id in rows.index:
        table = measured.match(measured.signals([id])["tsa"][0], k=4).table
        assert table["id"][0] == id
        assert table["machine"].tolist()[:2] == [rows["machine"][id]] * 2
        assert table["match"][0] == pytest.approx(1, abs=1e-6)
        assert table["match"][2] < 0.8 < table["match"][1]


def test_a_condition_is_one_on_rows(measured):
    tsa = measured.signals([0])["tsa"][0]
    assert set(measured.match(tsa, where="machine = 'm2'").table["machine"]) == {"m2"}
    with pytest.raises(InputError, match="no row of this length meets where"):
        measured.match(tsa, where="machine = 'm3'")
    with pytest.raises(InputError, match="has as many, 32 a tooth"):
        measured.match(np.sin(np.arange(640.0)))


def test_a_measured_row_is_compared_with_templates_and_a_simulated_one_with_measured_rows(database, measured):
    simulated = database.signals([0])["tsa"][0]
    assert len(measured.match(simulated, k=2).table) == 2
    assert "template" in database.match(measured.signals([0])["tsa"][0], k=2).table
