"""Unit: columns that a user's function computes from stored averages are read, resumed, extended, checked, removed."""

import importlib
import json
import pickle
import re
import shutil
import sys

import numpy as np
import pytest

import sigdb
from sigdb.core import DatabaseError, InputError
from sigdb.database import (
    AddedCheck,
    Database,
    check_added,
    check_complete,
    database_card,
    read_receipts,
    sealed_json,
)
from sigdb.database.added import added_part
from sigdb.database.store.store import Store
from sigdb.sweep import add_features, remove_features, repair, verify
from sigdb.sweep.work.engines import Processes
from sigdb.sweep.work.ownership import ownership_of

ADD = importlib.import_module("sigdb.sweep.work.add_features")

MODULE = '''
import numpy as np

def crest(tsa):
    """Crest factor of the average."""
    return {"crest": abs(tsa).max() / tsa.std()}

def picky(tsa, teeth, sensor):
    if teeth == 13:
        return {"top": tsa.max(), "of_13": 1.0}
    if tsa[0] > 0:
        raise ValueError("begins\\nabove 0")
    return {"top": tsa.max()}

def rare(tsa, torque):
    return {"rare": 1.0} if torque == 300 else {"most": 1.0}

def clash(tsa):
    return {"RMS": 1.0} if False else {"Kurtosis": 1.0}

def again(tsa):
    return {"crest": 1.0}

def fails(tsa):
    raise ValueError("always")
'''


@pytest.fixture
def shapes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name = re.sub(r"\W", "_", f"own_{tmp_path.name}")
    (tmp_path / f"{name}.py").write_text(MODULE, encoding="utf-8")
    return name


@pytest.fixture
def place(small_run, tmp_path):
    """Some hundred rows, two sensors, 12 and 13 teeth, some rows without a result."""
    return shutil.copytree(small_run[0], tmp_path / "signatures")


@pytest.fixture
def parts(parts_folder, tmp_path):
    """5060 rows in three parts."""
    return shutil.copytree(parts_folder, tmp_path / "parts")


def deep(place):
    """Findings in the added features alone, with a block computed again."""
    store = Store.at(place)
    rows = {receipt.part: receipt for receipt in read_receipts(store, "rows", {sigdb.open(place).manifest.hash})}
    return tuple(check_added(AddedCheck.of(store), rows, deep=True, sample=1))


def crest_of(database, ids, sensor=None):
    tsa = database.signals(ids, sensor=sensor)["tsa"].astype(float)
    return abs(tsa).max(axis=1) / tsa.std(axis=1)


def test_the_columns_take_part_in_every_reading(place, shapes, tmp_path):
    before = sigdb.open(place)
    files = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    done = add_features(place, f"{shapes}:crest", jobs=1)
    database = sigdb.open(place)
    second = database.sensors[1]
    assert done.columns == ("crest", f"crest__{second}", "crest_status")
    assert (done.new_rows, done.rows) == (len(database), len(database))
    assert {path: path.read_bytes() for path in files} == files
    cases = database.cases()
    ok = cases["status"] == "ok"
    assert done.failed == 0
    assert set(cases["crest_status"]) == {"ok"}
    ids = cases.loc[ok & (cases["teeth"] == 12), "id"].to_numpy()
    rows = cases.set_index("id").loc[ids]
    np.testing.assert_allclose(rows["crest"], crest_of(database, ids), rtol=1e-12)
    np.testing.assert_allclose(rows[f"crest__{second}"], crest_of(database, ids, second), rtol=1e-12)
    assert cases[before.cases().columns].equals(before.cases())
    greatest = float(rows["crest"].max())
    assert database.cases(f"crest >= {greatest!r} and teeth = 12")["id"].tolist() == [rows["crest"].idxmax()]
    assert (
        database.sql("select max(crest) as c, count(wigner_ville) as n from features where teeth = 12")["c"][0]
        == greatest
    )
    (batch,) = database.batches("id < 3", columns=["crest", "id"], rows=10)
    assert batch.schema.field("crest").metadata[b"description"].startswith(b"Crest factor of the average. Sensor ")
    assert [batch["crest"][i].as_py() for i in range(3)] == cases["crest"][:3].tolist()
    assert "crest" in {indicator["name"] for indicator in database_card(database)["indicators"]}
    export = database.export(tmp_path / "all.h5", signals=False)
    assert export.columns == before.export(tmp_path / "old.h5", signals=False).columns + 3
    check_complete(database, ["crest"])
    assert verify(place, deep=True, sample=1) == ()
    assert add_features(place, f"{shapes}:crest", jobs=1).new_rows == 0


def test_rows_for_which_it_fails_say_why_and_others_may_lack_names(place, shapes):
    done = add_features(place, f"{shapes}:picky", jobs=1)
    database = sigdb.open(place)
    names = {"top", "of_13", *(f"{name}__{database.sensors[1]}" for name in ("top", "of_13")), "picky_status"}
    assert set(done.columns) == names
    cases = database.cases("status = 'ok'")
    failed = cases["picky_status"].str.contains(f"{database.sensors[0]}: ValueError: begins above 0", regex=False)
    assert failed.any()
    assert cases.loc[failed, "top"].isna().all()
    assert cases.loc[cases["picky_status"] == "ok", "top"].notna().all()
    assert cases["of_13"].notna().equals(cases["teeth"] == 13)
    assert (cases.loc[cases["teeth"] == 13, "picky_status"] == "ok").all()


def test_a_name_that_is_no_column_is_a_failure_of_the_row(place, shapes, monkeypatch):
    """Rows of each tooth count show the names; a name that only another row gives comes too late."""
    monkeypatch.setattr(ADD, "_PROBED", 1)
    add_features(place, f"{shapes}:rare", jobs=1)
    cases = sigdb.open(place).cases("status = 'ok'")
    assert "most" in cases
    assert "rare" not in cases
    late = cases["rare_status"].str.contains("returned the name 'rare', which is no column of", regex=False)
    assert 0 < late.sum() < len(cases) / 4
    assert cases["most"].isna().equals(late)


def test_names_that_are_taken_are_refused_and_nothing_is_written(place, shapes):
    with pytest.raises(InputError, match="has a column Kurtosis already, of table features; let the function return"):
        add_features(place, f"{shapes}:clash", jobs=1)
    with pytest.raises(InputError, match=rf"{shapes}:fails gives no numbers for up to .* ValueError: always"):
        add_features(place, f"{shapes}:fails", jobs=1)
    assert not (place / "added").exists()
    add_features(place, f"{shapes}:crest", jobs=1)
    with pytest.raises(InputError, match=f"has a column crest already, of {shapes}:crest"):
        add_features(place, f"{shapes}:again", jobs=1)
    assert [added.function for added in sigdb.open(place).added] == ["crest"]


def test_a_changed_module_is_refused_until_all_is_computed_again(place, shapes, tmp_path):
    add_features(place, f"{shapes}:crest", jobs=1)
    old = sigdb.open(place).cases()["crest"]
    (tmp_path / f"{shapes}.py").write_text(MODULE.replace("abs(tsa).max()", "2 * abs(tsa).max()"), encoding="utf-8")
    with pytest.raises(InputError, match=rf"{shapes} has changed since .* compute all again with --replace"):
        add_features(place, f"{shapes}:crest", jobs=1)
    (finding,) = deep(place)
    assert (finding.kind, finding.key) == ("unfinished", None)
    assert "its values cannot be computed again" in finding.what
    assert "--replace" in finding.remedy
    assert verify(place) == ()
    done = add_features(place, f"{shapes}:crest", jobs=1, replace=True)
    assert done.new_rows == done.rows
    np.testing.assert_allclose(sigdb.open(place).cases()["crest"], 2 * old, rtol=1e-12)
    assert deep(place) == ()


def test_a_module_that_is_not_here_leaves_the_columns_readable_and_removable(place, shapes, tmp_path, monkeypatch):
    add_features(place, f"{shapes}:crest", jobs=1)
    monkeypatch.chdir("/")
    monkeypatch.delitem(sys.modules, shapes)
    assert sigdb.open(place).cases()["crest"].notna().any()
    assert "no such module" in deep(place)[0].what
    with pytest.raises(InputError, match=f"added: {shapes}:crest"):
        remove_features(place, f"{shapes}:picky")
    assert remove_features(place, f"{shapes}:crest")[0] == "crest"
    assert "crest" not in sigdb.open(place).cases()
    assert verify(place) == ()


def test_stopped_and_gone_on_it_writes_the_same(parts, shapes, digests, monkeypatch):
    one = shutil.copytree(parts, parts.parent / "one")
    add_features(one, f"{shapes}:crest", jobs=1)

    class Stopped(Processes):
        def receipts(self, make, work, store, parts):
            yield make(pickle.loads(pickle.dumps(work)), store, parts[0])  # as a worker gets it
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(ADD, "Processes", Stopped)
        with pytest.raises(KeyboardInterrupt):
            add_features(parts, f"{shapes}:crest", jobs=1)
    some = sigdb.open(parts).cases()
    assert some["crest_status"].notna().sum() == 2048
    assert some["crest"].notna().equals(some["crest_status"] == "ok")
    (finding,) = verify(parts)
    assert finding.kind == "unfinished"
    assert "2 of 3 parts of the features" in finding.what
    assert f"sigdb add-features {parts} {shapes}:crest" in finding.remedy
    steps = []
    done = add_features(parts, f"{shapes}:crest", jobs=1, on_progress=steps.append)
    assert (done.new_rows, done.rows) == (5060 - 2048, 5060)
    assert [step.done for step in steps][:: len(steps) - 1] == [2048, 5060]
    assert digests(parts) == digests(one)


def test_parts_of_other_averages_are_computed_again(place, shapes):
    """The database has grown, or rows were made again with another result: receipts keep the averages' SHA-256."""
    add_features(place, f"{shapes}:crest", jobs=1)
    path = place / "receipts" / "rows-00000.json"
    receipt = sigdb.open(place).receipts("rows")[0]
    other = json.loads(path.read_text(encoding="utf-8"))
    del other["sha256"]
    other["files"][1]["sha256"] = "0" * 64
    path.write_bytes(sealed_json(other))
    database = sigdb.open(place)
    ids = slice(receipt.first, receipt.first + receipt.rows)
    status = database.cases()["crest_status"]
    assert status[ids].isna().all()
    assert status.isna().sum() == receipt.rows
    assert add_features(place, f"{shapes}:crest", jobs=1).new_rows == receipt.rows
    assert sigdb.open(place).cases()["crest_status"].notna().all()


@pytest.mark.parametrize("where", ["part", "receipt", "description"])
def test_any_flipped_bit_is_found_and_a_part_is_repaired(place, shapes, digests, where):
    add_features(place, f"{shapes}:crest", jobs=1)
    whole = digests(place)
    name = f"{shapes}.crest"
    path = {
        "part": place / "added" / name / "part-00000.parquet",
        "receipt": place / "receipts" / f"added.{name}-00000.json",
        "description": place / "added" / f"{name}.json",
    }[where]
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    (finding,) = verify(place)
    assert finding.kind == "damage"
    assert finding.file == path.relative_to(place).as_posix()
    if where == "description":
        assert finding.remedy == f"compute its columns again with: sigdb add-features {place} {shapes}:crest --replace"
        add_features(place, f"{shapes}:crest", jobs=1, replace=True)
    else:
        with pytest.raises(DatabaseError, match=r"sigdb verify .* --repair"):
            sigdb.open(place).cases()
        assert repair(place, jobs=1).left == ()
    assert digests(place) == whole
    assert deep(place) == ()


def test_deep_finds_numbers_that_are_not_the_functions(place, shapes):
    add_features(place, f"{shapes}:crest", jobs=1)
    store = Store.at(place)
    with Database(store) as database:
        (rows,) = database.receipts("rows")
        (added,) = database.added
        units = {sensor: database.unit("tsa", sensor) for sensor in database.sensors}
    function = added.made_by(str(place.parent))
    work = added_part.AddedWork(added=added, function=function, units=units)
    numbers = added_part._numbers
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(added_part, "_numbers", lambda *arguments: {"crest": numbers(*arguments)["crest"] * (1 + 1e-12)})
        added_part.make_added_part(work, store, rows.part)
    assert verify(place) == ()
    (finding,) = deep(place)
    assert finding.key == (added.kind, 0)
    assert f"crest is not what {shapes}:crest gives again" in finding.what
    assert repair(place, deep=True, sample=1, jobs=1).left == ()


def test_files_of_removed_or_unknown_sets_are_foreign_and_a_busy_place_is_refused(place, shapes):
    add_features(place, f"{shapes}:crest", jobs=1)
    (place / "added" / f"{shapes}.crest.json").unlink()
    assert "crest" not in sigdb.open(place).cases()
    assert {finding.kind for finding in verify(place)} == {"foreign"}
    with ownership_of(Store.at(place)), pytest.raises(DatabaseError, match="already running"):
        add_features(place, f"{shapes}:crest", jobs=1)
