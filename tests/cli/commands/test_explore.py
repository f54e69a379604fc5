"""The command that opens the explorer: what it serves, and what it refuses."""

import struct
from json import loads

import numpy as np
import pytest
from starlette.testclient import TestClient

import sigdb.explorer
from sigdb.explorer import DEFAULT_RIG, LiveRig
from sigdb.explorer.app import Explorer, explorer_app
from sigdb.ingest import IngestSettings, ingest

HOST = "127.0.0.1:8000"


@pytest.fixture
def served(monkeypatch):
    """What the command would serve: a client of the page that is called with the arguments of the command."""

    def serve(rig, source, *, gear, database, row, recordings, view, port, browser, on_address):
        explorers.append(Explorer(LiveRig(rig, gear), source, database=database, row=row))

    def client():
        app = explorer_app(explorers[-1], token="secret", hosts=(HOST,))
        return TestClient(app, base_url=f"http://{HOST}", headers={"X-Sigdb-Token": "secret"})

    explorers = []
    monkeypatch.setattr(sigdb.explorer, "serve_explorer", serve)
    yield client
    for explorer in explorers:
        explorer.recordings.close()


def facts_of(answer):
    (length,) = struct.unpack_from("<I", answer.content)
    return loads(answer.content[4 : 4 + length])


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A database of two recordings without a rig; one of them has a label."""
    folder, rate, t = tmp_path_factory.mktemp("measured"), 2048.0, np.arange(4096) / 2048.0
    for name in ("a", "b"):
        np.savez(folder / f"{name}.npz", a1=np.cos(2 * np.pi * 120 * t), tacho=5.0 * (10 * t % 1 < 0.1))
    (folder / "recordings.csv").write_text(
        "file,machine,state,tooth\na.npz,press,chipped,4\nb.npz,press,unknown,\n", encoding="utf-8"
    )
    settings = IngestSettings(teeth="12", averages=5, reading={"tacho": "tacho", "sampling_rate": rate})
    ingest(folder, folder / "db", settings=settings, jobs=1)
    return folder / "db"


def test_a_database_of_recordings_opens_without_a_rig_of_its_own(leave, served, measured):
    code, out, err = leave("explore", measured, "1", "--no-browser")
    assert (code, out, err) == (0, "", "")
    client = served()
    start = facts_of(client.post("/api/start", json={}))["start"]
    assert (start["rig"]["source"], start["row"]) == (DEFAULT_RIG, 1)
    assert start["database"]["rows"] >= 2
    assert start["database"]["sensors"] == ["measured"]
    rows = client.post("/api/table", json={"sql": "select id, tooth from cases order by id"}).json()["rows"]
    damaged = {row: facts_of(client.post("/api/row", json={"id": row}))["damaged"] for row, _ in rows}
    assert damaged == {row: [tooth] if tooth else [] for row, tooth in rows}
    assert 4 in dict(rows).values()
    assert client.post("/api/nearest", json={"id": rows[0][0]}).status_code == 200
    assert client.post("/api/map", json={"x": "id", "y": None, "value": "kurtosis"}).status_code == 200


def test_a_built_in_rig_is_served(leave, served):
    assert leave("explore", "nasa-spiral-bevel", "--no-browser")[0] == 0
    start = facts_of(served().post("/api/start", json={}))["start"]
    assert (start["rig"]["source"], start["database"]) == ("nasa-spiral-bevel", None)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nasa-spiral-bevel", "1"), "ID is a row of a database"),
        (("no-such-rig",), "no-such-rig"),
        (("nasa-spiral-bevel", "--gear", "wheel"), "wheel"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_a_sentence(leave, arguments, message):
    code, out, err = leave("explore", *arguments, "--no-browser")
    assert code != 0
    assert out == ""
    assert message in err
    assert "Traceback" not in err
