"""Unit: small synthetic twins of the layout of each set are ingested and evaluated; their signals are made here."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.io import savemat

import sigdb
from sigdb.core import InputError
from sigdb.public_sets import check_folder, evaluate_set, ingest_set, load_public_set

TURNS = 30


def mesh(teeth, rate, rpm, seed=0, *, revolutions=TURNS, noise=0.03):
    """A mesh with two harmonics and a trace of its pitch errors, and the revolutions at each sample."""
    turns = np.arange(int(revolutions * 60 / rpm * rate)) / rate * rpm / 60
    stream = np.random.default_rng(seed)
    errors = sum(0.06 * np.cos(2 * np.pi * order * turns + order) for order in (1, 2, 3, 5))
    signal = (1 + errors) * (np.cos(2 * np.pi * teeth * turns) + 0.5 * np.cos(4 * np.pi * teeth * turns + 1))
    return signal + noise * stream.standard_normal(len(turns)), turns


def write_csv(path, columns, *, header=True):
    path.parent.mkdir(parents=True, exist_ok=True)
    names = ",".join(columns) if header else ""
    np.savetxt(path, np.column_stack(list(columns.values())), "%.5g", ",", header=names, comments="")


def spectraquest(folder):
    for number, name in enumerate(("h30hz0", "h30hz50", "b30hz0")):
        x, _ = mesh(32, 12800, 1785, number)
        write_csv(folder / f"{name}.csv", {"a1": x})
    return {}


def seu(folder):
    x, _ = mesh(29, 6400, 1200, revolutions=TURNS)
    (folder / "gearset").mkdir()
    lines = [*(f"Line {i}" for i in range(15)), *("\t".join([f"{value:.5g}"] * 8) + "\t" for value in x)]
    (folder / "gearset" / "Chipped_20_0.csv").write_text("\n".join(lines), encoding="utf-8")
    return {
        "teeth": "29",
        "channels": ["motor"],
        "reading": {"sampling_rate": 6400.0},
        "averaging": {"speed_rpm": 1200.0},
    }


def mcc5_thu(folder):
    names = load_public_set("mcc5-thu").settings["reading"]["names"]
    for number, name in enumerate(
        ("health_torque_circulation_1000rpm_10Nm", "teeth_crack_L_torque_circulation_1000rpm_10Nm")
    ):
        x, turns = mesh(36, 12800, 1000, number)
        write_csv(folder / f"{name}.csv", dict.fromkeys(names, x) | {"speed": 5.0 * (turns % 1 < 0.1)})
    return {"channels": ["gearbox_vibration_x"], "reading": {"ratio": "1"}}


def phm2009(folder):
    x, turns = mesh(32, 200e3 / 3, 3000)
    write_csv(folder / "run.csv", {"i": x, "o": x, "t": 5.0 * (10 * turns % 1 < 0.3)}, header=False)
    return {"channels": ["input"]}


def mfpt(folder):
    x = np.random.default_rng(5).standard_normal(48828)
    (folder / "3 - Outer").mkdir()
    savemat(folder / "3 - Outer" / "o.mat", {"bearing": {"sr": 48828.0, "gs": x[:, None], "load": 50.0, "rate": 25.0}})
    return {}


def cwru(folder):
    x = np.random.default_rng(5).standard_normal(24000)
    savemat(folder / "97.mat", {"X097_DE_time": x[:, None], "X097RPM": 1796.0})
    return {"reading": {"sampling_rate": 12000.0}}


def gear0(folder):
    x, _ = mesh(23, 256000, 2000)
    savemat(folder / "3027_217_Data_Chan16.mat", {"Data1": x[:, None]})
    return {}


TWINS = {
    "seu": (seu, None),
    "mcc5-thu": (mcc5_thu, {"health": 1, "teeth_crack_L": 1}),
    "phm2009": (phm2009, {"unknown": 1}),
    "mfpt": (mfpt, {}),
    "cwru": (cwru, {}),
    "gear0": (gear0, None),
}
"""Writer of a twin, and rows with an average by state; none where the set has no gears.

None: the layout is read, but so short a record without a tacho leaves the speed in doubt.
"""


@pytest.mark.parametrize("name", TWINS)
def test_a_twin_is_ingested(name, tmp_path):
    write, states = TWINS[name]
    (tmp_path / "set").mkdir()
    settings = write(tmp_path / "set")
    described = load_public_set(name)
    check = check_folder(name, described, tmp_path / "set")
    done = ingest_set(described, check, tmp_path / "db", settings=settings, jobs=1)
    cases = sigdb.open(tmp_path / "db").cases()
    ok = cases[cases["status"] == "ok"]
    if states is None:
        assert set(cases["status_code"]) <= {"ok", "doubtful"}, cases["status"].tolist()
    else:
        assert ok.groupby("state")["id"].size().to_dict() == states, cases["status"].tolist()
    assert done.recordings == len(check.recordings)
    assert set(cases["set"]) == {name}
    if states == {}:
        assert set(cases["status_code"]) == {"no_gear"}, cases["status"].tolist()


@pytest.fixture(scope="module")
def ingested(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    (folder / "files").mkdir()
    spectraquest(folder / "files")
    described = load_public_set("spectraquest")
    check = check_folder("spectraquest", described, folder / "files")
    ingest_set(described, check, folder / "db", jobs=1)
    return described, check, folder / "db"


def test_results(ingested, monkeypatch):
    """Answers are compared with the right one, which is no damage whatever the label says."""
    described, check, database = ingested
    asked = []

    def answer(path, *, healthy, channel, load, healthy_load, teeth, rig, **options):
        asked.append((path.name, [each.name for each in healthy], load, healthy_load, teeth, options["mesh_phase"]))
        if path.name == "h30hz50.csv":
            raise InputError("too short")
        kind = "one tooth" if path.name == "b30hz0.csv" else "no change"
        return SimpleNamespace(kind=kind, answer=f"{kind}.")

    monkeypatch.setattr("sigdb.public_sets.set_results.diagnose", answer)
    found = evaluate_set(described, check, database, diagnoses=4)
    assert asked == [
        ("b30hz0.csv", ["h30hz0.csv", "h30hz50.csv"], 0.0, [0.0, 50.0], "32/80", True),
        ("h30hz0.csv", ["h30hz50.csv"], 0.0, [50.0], "32/80", True),
        ("h30hz50.csv", ["h30hz0.csv"], 50.0, [0.0], "32/80", True),
    ]
    assert [each.verdict for each in found.answers] == ["wrong", "right", "abstained"]
    assert found.verdicts == {"wrong": 1, "right": 1, "abstained": 1}
    content = json.loads(json.dumps(found.as_json()))
    assert content["described"]["sources"]["pmx"]["url"].startswith("https://")
    assert content["folder"]["missing"] == ["17 of 20 files {state}30hz{load}.csv*"]
    assert {row["state"]: row["rows"] for row in content["rows"]} == {"healthy": 2, "broken tooth": 1}
    (kurtosis,) = [each for each in content["indicators"] if each["indicator"] == "kurtosis"]
    assert (kurtosis["healthy"], kurtosis["damaged"]) == (2, 1)
    assert kurtosis["area"] in (0.0, 0.5, 1.0)


def test_a_folder_without_recordings_is_refused(tmp_path):
    described = load_public_set("qinyi")
    check = check_folder("qinyi", described, tmp_path)
    with pytest.raises(InputError, match=r"holds no recording of QinYi .* no cited page states raw recordings of it"):
        ingest_set(described, check, tmp_path / "db")
