import base64
import hashlib
import json
import re
import struct

import numpy as np
import pytest
from starlette.testclient import TestClient

import sigdb.explorer.app as app_module
from sigdb.explorer import View
from sigdb.explorer.app import packed
from sigdb.explorer.live import Shown
from sigdb.explorer.stored import StoredRows


def unpacked(content):
    (length,) = struct.unpack_from("<I", content)
    facts = json.loads(content[4 : 4 + length])
    numbers = np.frombuffer(content, "<f4", offset=4 + length)
    arrays = {
        name: numbers[first : first + int(np.prod(shape))].reshape(shape) for name, shape, first in facts["arrays"]
    }
    return facts, arrays


def test_packed_arrays_come_back():
    shown = Shown(facts={"é": 1.5}, arrays={"a": np.arange(3.0), "b": np.ones((2, 2))})
    facts, arrays = unpacked(packed(shown))
    assert facts["é"] == 1.5
    assert arrays["a"].tolist() == [0, 1, 2]
    assert arrays["b"].tolist() == [[1, 1], [1, 1]]


def test_no_route_answers_without_the_token(app):
    paths = [route.path for route in app.routes if route.path.startswith("/api/")]
    assert len(paths) >= 12
    stranger = TestClient(app, base_url="http://127.0.0.1:8000")
    for path in paths:
        for headers in ({}, {"X-Sigdb-Token": "guess"}, {"X-Sigdb-Token": ""}, {"Cookie": "X-Sigdb-Token=secret"}):
            answer = stranger.post(f"{path}?X-Sigdb-Token=secret", json={"sql": "select 1"}, headers=headers)
            assert (path, answer.status_code) == (path, 403)


def test_only_the_page_itself_may_ask(app):
    for base, origin, status in (
        ("http://127.0.0.1:8000", "http://127.0.0.1:8000", 200),
        ("http://127.0.0.1:8000", "http://evil.example", 403),
        ("http://127.0.0.1:8000", "null", 403),
        ("http://evil.example", None, 403),
    ):
        headers = {"X-Sigdb-Token": "secret"} | ({"Origin": origin} if origin else {})
        answer = TestClient(app, base_url=base, headers=headers).post("/api/start", json={})
        assert answer.status_code == status


def test_the_page_loads_nothing_from_elsewhere(client):
    answer = client.get("/")
    assert answer.status_code == 200
    assert not re.search(r"(src|href)=\"(?!data:)|@import|url\(", answer.text)
    policy = dict(each.strip().split(" ", 1) for each in answer.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'self'"
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", answer.text, flags=re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    assert policy["script-src"].split() == [f"'sha256-{digest}'" for digest in digests]
    assert client.get("/main.js").status_code == client.get("/../app.py").status_code == 404


def test_start_describes_the_controls_of_the_rig(client):
    start = unpacked(client.post("/api/start", json={}).content)[0]["start"]
    names = [control["name"] for control in start["controls"]]
    assert names[:4] == ["tooth", "damaged_teeth", "stiffness_loss", "phase_shift_deg"]
    assert "crack_depth" not in names
    assert all(control["help"] and control["low"] < control["high"] for control in start["controls"])
    assert start["database"]["rows"] == 26
    assert [sensor["unit"] for sensor in start["sensors"]] == ["m/s", "m/s^2"]


@pytest.mark.parametrize(
    ("address", "view"),
    [
        ({}, {"tooth": 6, "stiffness_loss": 0.5}),
        ({"tab": "database"}, {"tooth": 6, "stiffness_loss": 0.5}),
        ({"tooth": "9", "snr_db": "3"}, {"tooth": 9, "snr_db": 3}),
        ({"tooth": "0", "sensor": "pinion-housing-vertical"}, {"sensor": "pinion-housing-vertical"}),
    ],
)
def test_the_first_answer_holds_the_picture_of_the_address(client, live, address, view):
    facts, arrays = unpacked(client.post("/api/start", json={"address": address}).content)
    expected = live.show(View.of(view))
    assert facts["shown"]["damaged"] == expected.facts["damaged"]
    np.testing.assert_allclose(arrays["tsa"], expected.arrays["tsa"], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("address", [{"tooth": "99"}, {"tooth": "six"}, {"sensor": "nose"}, ["tooth"], "tooth=6"])
def test_a_page_with_a_wrong_address_starts_without_a_picture(client, address):
    facts, arrays = unpacked(client.post("/api/start", json={"address": address}).content)
    assert facts["start"]["controls"]
    assert "shown" not in facts
    assert arrays == {}


def test_a_view_is_the_same_over_the_wire(client, live):
    settings = {"tooth": 6, "stiffness_loss": 0.4}
    facts, arrays = unpacked(client.post("/api/live", json=settings).content)
    shown = live.show(View.of(settings))
    assert facts["damaged"] == [6]
    assert {row["name"] for row in facts["indicators"]} >= {"fm4", "kurtosis"}
    for name, array in shown.arrays.items():
        np.testing.assert_allclose(arrays[name], array, rtol=1e-6, atol=1e-6 * np.abs(array).max())


def test_a_row_its_nearest_templates_and_a_map(client, database):
    row = int(database.cases("tooth = 6 and stiffness_loss = 0.4")["id"].iloc[0])
    facts, arrays = unpacked(client.post("/api/row", json={"id": row}).content)
    np.testing.assert_allclose(arrays["tsa"], database.signals([row])["tsa"][0], rtol=1e-6)
    assert facts["case"]["stiffness_loss"] == 0.4
    near = client.post("/api/nearest", json={"id": row}).json()
    best = dict(zip(near["columns"], near["rows"][0], strict=True))
    assert (best["tooth"], best["stiffness_loss"]) == (6, 0.4)
    assert "sigdb coverage has not been run" in near["verdict"]
    table = client.post("/api/map", json={"x": "tooth", "y": "stiffness_loss", "value": "fm4"}).json()
    where = "tooth = 6 and stiffness_loss = 0.4"
    expected = database.sql(f"select avg(fm4) as mean from cases where {where}")["mean"].iloc[0]
    assert table["mean"][table["y"].index(0.4)][table["x"].index(6)] == pytest.approx(expected)
    spread = client.post("/api/map", json={"x": "tooth", "value": "fm4", "where": "tooth > 0"}).json()
    assert np.sum(spread["count"]) == 24
    values = database.cases("tooth > 0")["fm4"]
    assert min(spread["y"]) - values.min() < (values.max() - values.min()) / 40


def test_a_row_without_a_label_has_no_damaged_tooth(database, monkeypatch):
    unlabelled = database.cases("id = 0").assign(tooth=None, damaged_teeth=None)
    monkeypatch.setattr(type(database), "cases", lambda self, where: unlabelled)
    assert StoredRows(database).row(0, None).facts["damaged"] == []


def test_sql_has_limits_and_reads_only(client):
    table = client.post(
        "/api/table", json={"sql": "select tooth, count(*) as n from cases group by all order by 1"}
    ).json()
    assert table["columns"] == ["tooth", "n"]
    assert table["rows"][0] == [0, 2]
    for sql, message in (
        ("drop table cases", "SELECT"),
        ("select * from read_csv('/etc/passwd')", "read_csv"),
        ("select * from range(1000000)", "rows"),
        ("select nothing from cases", "nothing"),
    ):
        answer = client.post("/api/table", json={"sql": sql})
        assert answer.status_code == 422
        assert message in answer.json()["error"]


def test_errors_are_sentences(client):
    for path, body in (
        ("live", {"tooth": 99, "stiffness_loss": 0.1}),
        ("live", {"tooth": "six"}),
        ("nearest", {"view": [6]}),
        ("recipe", {"view": "tooth=6"}),
        ("live", {"tooth": 6, "stiffness_loss": 0.1, "teeth": 3000}),
        ("live", {"tooth": 6, "stiffness_loss": 0.1, "speed_rpm": 1e308}),
        ("row", {"id": 10**9}),
        ("row", {"id": "one"}),
        ("map", {"x": "tooth", "y": "nose", "value": "fm4"}),
        ("map", {"x": "tooth", "y": 1, "value": "fm4"}),
        ("nearest", {"tsa": [1.0], "teeth": 12}),
        ("nearest", {"tsa": [1.0] * 768, "teeth": -1}),
        ("picture", {"view": {}, "format": "exe"}),
        ("picture", {"ids": [], "format": "png"}),
        ("picture", {"tsa": ["a"], "teeth": 12, "format": "png"}),
        ("picture", {"tsa": [1.0], "teeth": "12", "format": "png"}),
        ("recipe", {"view": {}, "ranges": {"specimen": [1]}}),
        ("recipe", {"view": {"tooth": 1, "stiffness_loss": 0.2}, "ranges": {"tooth": "all"}}),
        ("recipe", {"ranges": {"tooth": [None]}}),
        ("recipe", {"ranges": [1]}),
        ("diagnosis", {"recording": "none"}),
        ("diagnosis", {"recording": "none", "healthy": "none"}),
        ("diagnosis", {"recording": "none", "options": ["tacho"]}),
        ("diagnosis", {}),
    ):
        answer = client.post(f"/api/{path}", json=body)
        assert (path, body, answer.status_code) == (path, body, 422)
        assert "Traceback" not in answer.json()["error"]
        assert len(answer.json()["error"]) > 10
    for content in (b"{", b"[1]", b"\xff"):
        answer = client.post("/api/live", content=content)
        assert answer.status_code in (400, 422)
        assert "one JSON object" in answer.json()["error"]


def test_a_request_that_is_too_large_is_refused_with_a_remedy(client, monkeypatch):
    assert client.post("/api/live", content=b" " * (5 * 2**20)).status_code == 422
    monkeypatch.setattr(app_module, "MOST_BYTES", 2**20)
    answer = client.post("/api/upload?name=run.csv", content=b"1," * 2**20)
    assert answer.status_code == 422
    assert "more than 1 MiB" in answer.json()["error"]
    assert "--recording" in answer.json()["error"]


def test_pictures_are_files(client):
    png = client.post("/api/picture", json={"view": {"tooth": 6, "stiffness_loss": 0.4}, "format": "png"}).content
    assert png.startswith(b"\x89PNG")
    several = client.post("/api/picture", json={"ids": [0, 5], "format": "svg"}).content
    assert several.count(b"row ") >= 2
    average = {"tsa": np.sin(np.arange(768)).tolist(), "healthy": np.cos(np.arange(768)).tolist(), "teeth": 12}
    assert client.post("/api/picture", json=average | {"format": "png"}).content.startswith(b"\x89PNG")
    assert b"<svg" in client.post("/api/drawing", json={}).content[:500]


def test_a_dropped_average_is_matched(client, database, tmp_path):
    row = int(database.cases("tooth = 3 and stiffness_loss = 0.4")["id"].iloc[0])
    np.save(tmp_path / "average.npy", database.signals([row])["tsa"][0])
    content = (tmp_path / "average.npy").read_bytes()
    kept = client.post("/api/upload?name=average.npy", content=content).json()
    facts, arrays = unpacked(client.post("/api/diagnosis", json={"recording": kept["recording"]}).content)
    assert facts["answer"] is None
    near = client.post("/api/nearest", json={"tsa": arrays["tsa"].tolist(), "teeth": 12}).json()
    assert dict(zip(near["columns"], near["rows"][0], strict=True))["tooth"] == 3


def test_a_dropped_recording_is_diagnosed_as_by_the_command_line(client, tmp_path):
    from sigdb.diagnosis import diagnose

    rng, rate, speed, teeth = np.random.default_rng(0), 5000.0, 20.0, 20
    t = np.arange(int(4 * rate)) / rate
    x = np.cos(2 * np.pi * speed * teeth * t) + 0.3 * rng.standard_normal(len(t))
    tacho = (t * speed % 1 < 0.5).astype(float)
    np.savetxt(
        tmp_path / "run.csv", np.column_stack([t, x, tacho]), delimiter=",", header="time (s),x,tacho", comments=""
    )
    kept = client.post("/api/upload?name=run.csv", content=(tmp_path / "run.csv").read_bytes()).json()
    body = {"recording": kept["recording"], "teeth": "20", "options": {"tacho": "tacho", "channel": "x"}}
    facts, arrays = unpacked(client.post("/api/diagnosis", json=body).content)
    expected = diagnose(tmp_path / "run.csv", teeth="20", tacho="tacho", channel="x")
    assert facts["answer"] == expected.answer
    np.testing.assert_allclose(arrays["tsa"], expected.signature.tsa, rtol=1e-4, atol=1e-5)
    body["options"]["colour"] = "red"
    assert "unknown options colour" in client.post("/api/diagnosis", json=body).json()["error"]


def test_a_recipe_of_ranges_states_its_size(client):
    made = client.post(
        "/api/recipe", json={"view": {"tooth": 1, "stiffness_loss": 0.2}, "ranges": {"tooth": [1, 2, 3]}}
    ).json()
    assert made["rows"] == 3
    assert made["bytes"] > 0
    assert made["seconds"] > 0
    assert "tooth = [\n    1,\n    2,\n    3,\n]" in made["recipe"]
