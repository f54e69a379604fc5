"""Unit: a database in an object store, a local server that speaks S3, is the same as one in a directory."""

import json
import pickle
import time

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.core.errors import DatabaseError, InputError
from sigdb.database.store.store import Store
from sigdb.sweep import add_features, remove_features, run, verify


def parquet(store):
    return {name: store.get(name) for name in store.sizes() if name.endswith(".parquet")}


@pytest.fixture
def made(place_in_bucket, small_run):
    """A database in the object store: the files of one in a directory."""
    here, there = Store.at(small_run[0]), Store.at(place_in_bucket)
    for name in here.sizes():
        if not name.startswith("."):
            there.put(name, here.get(name))
    return place_in_bucket


def test_the_same_files_as_in_a_directory(place_in_bucket, small_plan, small_run):
    run(small_plan, place_in_bucket, recipe="# a recipe", jobs=1)
    here, there = Store.at(small_run[0]), pickle.loads(pickle.dumps(Store.at(place_in_bucket)))  # as workers get it
    assert parquet(there) == parquet(here)
    assert set(there.sizes()) == set(here.sizes()) - {".lock"}


def test_it_is_read_like_a_directory(made, small):
    there = sigdb.open(made)
    assert len(there) == len(small)
    pd.testing.assert_frame_equal(there.cases("tooth = 6"), small.cases("tooth = 6"))
    pd.testing.assert_frame_equal(there.templates(), small.templates())
    ids = small.cases("teeth = 12")["id"].to_numpy()[[5, 0, 17]]
    np.testing.assert_array_equal(there.signals(ids)["tsa"], small.signals(ids)["tsa"])


def test_a_sweep_goes_on_there(made, small_plan):
    store = Store.at(made)
    before = parquet(store)
    store.delete("receipts/rows-00000.json")
    assert run(small_plan, made, jobs=1).new_rows == small_plan.rows
    assert run(small_plan, made, jobs=1).new_rows == 0
    assert parquet(store) == before


def test_another_recipe_is_refused_there(made, parts_plan):
    with pytest.raises(InputError, match=r"s3://bucket.* was made from another recipe"):
        run(parts_plan, made, jobs=1)


def test_damage_is_found_there(made):
    store = Store.at(made)
    content = bytearray(store.get("features/part-00000.parquet"))
    content[len(content) // 2] ^= 4
    store.put("features/part-00000.parquet", bytes(content))
    with pytest.raises(DatabaseError, match=r"s3://bucket\d+/some/prefix/features/part-00000\.parquet is damaged"):
        sigdb.open(made).features()


def test_a_second_sweep_is_refused_while_the_first_gives_signs_of_life(made, small_plan):
    store = Store.at(made)
    owner = {"process": 17, "host": "elsewhere", "token": "x"}
    store.put(".owner", json.dumps(owner | {"alive": time.time() - 10}).encode())
    with pytest.raises(DatabaseError, match=r"already running on it \(process 17 on elsewhere\)"):
        run(small_plan, made, jobs=1)
    store.put(".owner", json.dumps(owner | {"alive": time.time() - 1000}).encode())
    assert run(small_plan, made, jobs=1).new_rows == 0
    assert store.size(".owner") is None


def test_the_command_line_takes_it(made):
    result = CliRunner().invoke(cli, ["query", made, "select count(*) as rows from features", "--format", "json"])
    assert json.loads(result.stdout) == [{"rows": len(sigdb.open(made))}]


def test_places_that_do_not_exist(place_in_bucket, small_plan):
    with pytest.raises(InputError, match=r"is not a sigdb database"):
        sigdb.open(place_in_bucket)
    nowhere = place_in_bucket.replace("s3://bucket", "s3://other")
    with pytest.raises(DatabaseError, match=r"s3://other.*: cannot be written \(.*NO_SUCH_BUCKET"):
        run(small_plan, nowhere, jobs=1)
    with pytest.raises(InputError, match=r"ftp://x/y: not a place for a database .*; give a directory or s3://"):
        sigdb.open("ftp://x/y")
    with pytest.raises(InputError, match=r"s3://: "):
        sigdb.open("s3://")


def test_features_are_added_there_too(made, small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in_a_bucket.py").write_text("def peak(tsa):\n    return {'peak': tsa.max()}\n", encoding="utf-8")
    done = add_features(made, "in_a_bucket:peak", jobs=1)
    assert (done.new_rows, done.failed) == (len(small), 0)
    assert sigdb.open(made).cases("tooth = 6")["peak"].notna().all()
    assert add_features(made, "in_a_bucket:peak", jobs=1).new_rows == 0
    assert verify(made) == ()
    remove_features(made, "in_a_bucket:peak")
    assert "peak" not in sigdb.open(made).cases()
    assert verify(made) == ()
