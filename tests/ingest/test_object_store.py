"""Unit: recordings in an object store, a local server that speaks S3, are the same database as in a directory."""

import json

import pytest
from click.testing import CliRunner

import sigdb
from sigdb.cli.main import cli
from sigdb.database.store.store import Store
from sigdb.ingest import enter_findings, ingest, verify

WEEKS = 7
"""Recordings of a machine, a week apart; a tooth of the last one is weak."""


@pytest.fixture(scope="module")
def lists(tmp_path_factory, write_recording):
    """A list of the healthy recordings, one of all, and the finding of an inspection after the last."""
    folder = tmp_path_factory.mktemp("weeks")
    lines = ["file,machine,date,state"]
    for week in range(WEEKS):
        weak = week == WEEKS - 1
        write_recording(folder / f"w{week}.npz", seed=week, pulse=0.8 * weak)
        lines.append(f"w{week}.npz,press,2026-01-{1 + 4 * week:02d},{'unknown' if weak else 'normal'}")
    (folder / "healthy.csv").write_text("\n".join(lines[:-1]), encoding="utf-8")
    (folder / "all.csv").write_text("\n".join(lines), encoding="utf-8")
    (folder / "found.csv").write_text("date,since,machine,tooth\n2026-02-01,2026-01-24,press,4\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def whole_average(settings_with):
    """An average of all revolutions of one channel."""
    return settings_with(averages=None, channels=("a1",))


def content(place):
    """All files of a database; of receipts, which hold times, the names only."""
    store = Store.at(place)
    names = [name for name in store.sizes() if not name.startswith(".")]
    return {name: "" if name.startswith("receipts/") else store.get(name) for name in names}


def run(*arguments):
    """Run a command; its exit code and what it printed."""
    result = CliRunner().invoke(cli, [*map(str, arguments)], standalone_mode=False, catch_exceptions=False)
    return int(result.return_value), result.stdout


def test_a_machine_is_ingested_extended_monitored_and_labelled_there(
    place_in_bucket, lists, whole_average, few_tries, tmp_path
):
    for place in (place_in_bucket, tmp_path / "db"):
        assert ingest(lists / "healthy.csv", place, settings=whole_average, jobs=1).rows == WEEKS - 1
        assert ingest(lists / "all.csv", place, settings=whole_average, jobs=1).new_recordings == 1
    assert content(place_in_bucket) == content(tmp_path / "db")
    code, text = run("monitor", place_in_bucket, "--format", "json")
    (history,) = json.loads(text)
    assert (code, history["kind"], history["machine"]) == (1, "one tooth", "press")
    assert [look["alarm"] for look in history["looks"]] == [False] * (WEEKS - 1) + [True]
    assert [enter_findings(place, lists / "found.csv") for place in (place_in_bucket, tmp_path / "db")] == [1, 1]
    assert content(place_in_bucket) == content(tmp_path / "db")
    assert sigdb.open(place_in_bucket).cases("tooth = 4")["recording"].tolist() == [f"w{WEEKS - 1}.npz"]
    assert verify(place_in_bucket, deep=True, sample=1) == ()


def test_damage_is_found_and_repaired_there(place_in_bucket, made):
    here, there = Store.at(made), Store.at(place_in_bucket)
    for name in content(made):
        there.put(name, here.get(name))
    there.put("features/part-00001.parquet", here.get("features/part-00001.parquet")[:-1] + b"x")
    assert [(finding.kind, finding.part) for finding in verify(place_in_bucket)] == [("damage", 1)]
    assert run("verify", place_in_bucket, "--repair", "--jobs", 1)[0] == 0
    assert content(place_in_bucket) == content(made)
