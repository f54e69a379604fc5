"""Unit: ``retry_failed`` makes parts again that hold templates or rows without a result, and no others."""

import importlib
import shutil

import numpy as np
import pytest

import sigdb
from sigdb.core.errors import SigdbError
from sigdb.sweep import run, verify

# Two template parts: 64 of the rig as it is (one undamaged), and of another torque, at which the march fails below.
TEXT = """
[sweep]
rig = "nasa-spiral-bevel"
seed = 7
specimens = 33

[[sweep.grid]]
tooth = 1
stiffness_loss = {losses}

[[sweep.grid]]
tooth = 2
stiffness_loss = 0.5
phase_shift_deg = 4.5
operating.torque = 100.0
index_error = 0.0

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""
MARCH = importlib.import_module("sigdb.dynamics.march.transient")


@pytest.fixture(scope="module")
def plan(plan_of):
    return plan_of(TEXT.format(losses=[round(0.005 * k, 3) for k in range(1, 64)]))


@pytest.fixture(scope="module")
def made(plan, tmp_path_factory):
    """A database in which the march of the last template did not come to rest, and its rows have no result."""

    def unsettled(*arguments, **options):
        raise SigdbError("the motion did not settle")

    folder = tmp_path_factory.mktemp("failed") / "db"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MARCH, "settle", unsettled)
        assert run(plan, folder, jobs=1).failed == 33
    return folder


@pytest.fixture
def failed(made, tmp_path):
    return shutil.copytree(made, tmp_path / "db")


def times(folder):
    files = [path for path in folder.rglob("*.*") if path.is_file() and path.name != ".lock"]
    return {path.relative_to(folder).as_posix(): path.stat().st_mtime_ns for path in files}


def test_parts_with_failures_are_made_again(plan, failed, tmp_path, digests):
    run(plan, tmp_path / "undisturbed", jobs=1)
    assert plan.template_parts == 2
    assert plan.row_parts == 2
    assert set(sigdb.open(failed).sql("select status from features where id >= 2079")["status"]) == {
        "the motion did not settle"
    }
    before = times(failed)
    assert run(plan, failed, jobs=1).new_rows == 0
    assert times(failed) == before
    summary = run(plan, failed, jobs=1, retry_failed=True)
    assert (summary.new_rows, summary.failed) == (plan.rows - 2048, 0)
    changed = {name for name, time in times(failed).items() if before.get(name) != time}
    assert changed == {
        "templates/part-00001.parquet",
        "receipts/templates-00001.json",
        "features/part-00001.parquet",
        "signals/part-00001.parquet",
        "receipts/rows-00001.json",
    }
    assert digests(failed) == digests(tmp_path / "undisturbed")
    assert verify(failed, deep=True, sample=2) == ()


def test_what_fails_again_stays_as_it_was(plan_of, tmp_path, digests):
    rough = (
        "seed = 1\nspecimens = 20\n[[sweep.grid]]\ntooth = 3\nstiffness_loss = 0.4\nindex_error = 2e-5\n"
        '[signature]\nsamples_per_tooth = 32\nsensors = ["pinion-vertical"]\n'
    )
    plan = plan_of(rough)
    first = run(plan, tmp_path / "db", jobs=1)
    content = digests(tmp_path / "db")
    again = run(plan, tmp_path / "db", jobs=1, retry_failed=True)
    assert 0 < again.failed == first.failed < 20
    assert again.new_rows == 20
    assert digests(tmp_path / "db") == content


def test_stopped_while_receipts_are_deleted_no_row_is_left_of_a_template_that_is_made_again(plan, failed, monkeypatch):
    """Whatever goes on afterwards, with the option or without: rows agree with the templates that are there."""
    storage = importlib.import_module("sigdb.database.store.store")
    delete = storage.Store.delete
    deleted = []

    def once(self, name):
        if name.startswith("receipts/"):
            if deleted:
                raise KeyboardInterrupt
            deleted.append(name)
        delete(self, name)

    monkeypatch.setattr(storage.Store, "delete", once)
    with pytest.raises(KeyboardInterrupt):
        run(plan, failed, jobs=1, retry_failed=True)
    monkeypatch.undo()
    assert deleted == ["receipts/rows-00001.json"]
    assert len(sigdb.open(failed)) == 2048
    run(plan, failed, jobs=1)
    database = sigdb.open(failed)
    bad = database.sql("select template from templates where status <> 'ok'")["template"].tolist()
    rows = database.cases()
    assert np.array_equal(rows["template"].isin(bad), rows["status"] != "ok")
    assert run(plan, failed, jobs=1, retry_failed=True).failed == 0
