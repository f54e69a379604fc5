"""Unit: the card of a database of recordings counts what was entered."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.core import InputError
from sigdb.database import database_card, recordings_card
from sigdb.ingest import IngestSettings, ingest


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two healthy recordings of a machine, one damaged one of another, and one that cannot be read."""
    folder = tmp_path_factory.mktemp("recordings")
    angle = 2 * np.pi * np.arange(384) / 384
    for name, machine, tooth, torque in (("a", "m1", 0, 10.0), ("b", "m1", 0, 30.0), ("c", "m2", 3, 20.0)):
        facts = {"machine": machine, "tooth": tooth, "torque": torque, "date": f"2026-0{tooth + 1}-01"}
        tsa = np.cos(12 * angle) + 0.1 * np.random.default_rng(tooth).normal(size=(2, 384))
        np.savez(folder / f"{name}.npz", tsa=tsa, **facts)
    (folder / "d.npz").write_bytes(b"PK\x03\x04 no archive")
    settings = IngestSettings(averages_of="tsa", teeth="12", samples_per_tooth=32)
    ingest(folder, folder / "db", settings=settings, jobs=1)
    return folder / "db"


def test_it_counts_recordings_machines_and_labels(folder):
    card = recordings_card(sigdb.open(folder))
    assert (card["rows"], card["recordings"], card["failed"], card["machines"]) == (7, 4, 1, 2)
    labels = [(row["health"], row["recordings"], row["rows"]) for row in card["labels"]]
    assert labels == [("healthy", 2, 4), ("damaged", 1, 2)]
    torque = next(axis for axis in card["axes"] if axis["name"] == "torque")
    assert (torque["values"], torque["least"], torque["greatest"]) == (3, 10.0, 30.0)
    assert card["gears"] == [{"gear": "", "teeth": 12}]
    assert [row["code"] for row in card["statuses"]] == ["unreadable"]
    fm4 = next(row for row in card["indicators"] if row["name"] == "fm4")
    stored = sigdb.open(folder).sql("select fm4 from features where status = 'ok' and tooth = 0")["fm4"]
    assert fm4["healthy"] == pytest.approx(np.quantile(stored, [0.05, 0.5, 0.95]))


def test_the_command_writes_it_and_each_kind_of_database_has_its_own(folder):
    page = CliRunner().invoke(cli, ["card", str(folder)])
    assert page.exit_code == 0
    assert "| damaged | unknown | stated | 1 | 2 |" in page.output
    assert "without a result (`unreadable`)" in page.output
    facts = json.loads(CliRunner().invoke(cli, ["card", str(folder), "--format", "json"]).output)
    assert facts["recordings"] == 4
    with pytest.raises(InputError, match="holds recordings; use recordings_card"):
        database_card(sigdb.open(folder))
