"""Unit: facts of rows are those of the database, and only new parts are read."""

import shutil

import numpy as np
import pandas as pd
import pytest

import sigdb
from sigdb.database import Database
from sigdb.ingest import IngestSettings, enter_findings, ingest
from sigdb.monitoring.row_facts import row_facts

COLUMNS = ("id", "recording", "health", "rms")
FS, TEETH = 2048.0, 12
SETTINGS = IngestSettings(
    teeth=str(TEETH), samples_per_tooth=16, reading={"tacho": "tacho", "sampling_rate": FS}, channels=("a1",)
)


def write(folder, name):
    t = 20 * np.arange(int(2 * FS)) / FS
    errors = 1 + 0.2 * np.random.default_rng(5).normal(size=TEETH)
    x = np.cos(2 * np.pi * TEETH * t) * errors[(t * TEETH).astype(int) % TEETH]
    x += 0.1 * np.random.default_rng(len(name)).normal(size=t.size)
    np.savez(folder / name, a1=x, tacho=5.0 * (t % 1 < 0.1))


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings")
    for name in ("a.npz", "bb.npz"):
        write(folder, name)
    (folder / "recordings.csv").write_text("file,date\na.npz,2026-01-01\nbb.npz,2026-01-02\n", encoding="utf-8")
    ingest(folder, folder / "db", settings=SETTINGS, jobs=1)
    return folder


@pytest.fixture
def folder(begun, tmp_path, monkeypatch):
    """Two recordings and their database, with an empty cache."""
    monkeypatch.setenv("SIGDB_CACHE", str(tmp_path / "cache"))
    shutil.copytree(begun, tmp_path / "recordings")
    return tmp_path / "recordings"


@pytest.fixture
def parts_read(monkeypatch):
    """Numbers of the parts of each scan."""
    read, scan = [], Database.scan

    def noted(database, table, columns, parts=None):
        read.append(sorted(parts))
        return scan(database, table, columns, parts)

    monkeypatch.setattr(Database, "scan", noted)
    return read


def check(folder, where=None):
    database = sigdb.open(folder / "db")
    facts = row_facts(database, COLUMNS, where)
    pd.testing.assert_frame_equal(facts.reset_index(drop=True), database.cases(where)[list(COLUMNS)], check_dtype=False)
    return facts


def test_only_new_parts_are_read(folder, parts_read):
    check(folder)
    check(folder)
    more = folder / "more"
    more.mkdir()
    write(more, "ccc.npz")
    ingest(more, folder / "db", settings=SETTINGS, jobs=1)
    check(folder)
    assert parts_read == [[0, 1], [], [2]]


def test_a_part_whose_labels_have_changed_is_read_again(folder, parts_read, tmp_path):
    check(folder)
    (tmp_path / "found.csv").write_text("date,file,tooth,kind\n2026-02-01,bb.npz,3,pitting\n", encoding="utf-8")
    assert enter_findings(folder / "db", tmp_path / "found.csv") == 1
    assert check(folder)["health"].tolist() == ["unknown", "damaged"]
    assert parts_read == [[0, 1], [1]]


def test_a_condition_selects_rows(folder):
    assert check(folder, "recording = 'bb.npz'")["id"].tolist() == [65536]
    assert check(folder, "rms < 0").empty


@pytest.mark.parametrize("at", [0, 40, -5])
def test_a_damaged_cache_is_made_again(folder, tmp_path, parts_read, at):
    check(folder)
    (place,) = (tmp_path / "cache").glob("monitor-rows-*")
    content = bytearray(place.read_bytes())
    content[at] ^= 1
    place.write_bytes(content)
    check(folder)
    assert parts_read == [[0, 1], [0, 1]]
