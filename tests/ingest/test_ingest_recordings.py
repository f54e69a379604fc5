"""Unit: a folder of recordings becomes a database like that of a sweep, is resumed, and is extended."""

import json

import fsspec
import numpy as np
import pytest
from pyarrow import fs

import sigdb
from sigdb.core.errors import InputError
from sigdb.database.store.store import Store
from sigdb.ingest import enter_findings, ingest, verify
from sigdb.ingest.facts import recording_table
from sigdb.recording import read_recording, recorded_signature
from sigdb.signature import FEATURES, features


def parts(folder):
    return {path: path.read_bytes() for path in folder.rglob("*.parquet")}


def test_each_average_of_each_channel_is_a_row_and_what_cannot_be_read_is_one_with_the_reason(made):
    database = sigdb.open(made)
    rows = database.cases()
    assert rows.groupby("recording").size().to_dict() == {"m1-a.npz": 4, "m1-b.npz": 4, "m2-a.npz": 4, "broken.npz": 1}
    ok = rows[rows["status"] == "ok"]
    assert (ok["averages"] == 25).all()
    assert ok.groupby(["recording", "channel"])["draw"].apply(list).tolist() == [[0, 1]] * 6
    np.testing.assert_allclose(ok["shaft_rpm"], 1200, rtol=1e-4)
    np.testing.assert_allclose(ok["begin"].to_numpy().reshape(-1, 2), [[0.05, 1.3]] * 6, atol=1e-3)
    (broken,) = rows[rows["status"] != "ok"].to_dict("records")
    assert (broken["status_code"], broken["recording"]) == ("unreadable", "broken.npz")
    assert "cannot be read as NPZ" in broken["status"]
    assert np.isnan(broken["rms"])


def test_rows_have_the_facts_of_the_table_and_of_the_file(made, folder):
    rows = sigdb.open(made).cases("draw = 0 and channel = 'a1'").set_index("recording")
    a, b, c = (rows.loc[name] for name in ("m1-a.npz", "m1-b.npz", "m2-a.npz"))
    assert (a["machine"], a["date"], a["load"], a["torque"], a["source"]) == ("m1", "2026-01-10", 50, 20, "measured")
    assert (a["tooth"], a["health"], a["kind"], a["label_trust"]) == (0, "healthy", "none", "stated")
    assert (b["tooth"], b["health"], b["kind"], b["label_trust"]) == (4, "damaged", "breakage", "seeded")
    assert np.isnan(c["tooth"])
    assert (c["health"], c["kind"], c["label_trust"]) == ("unknown", "unknown", "unknown")
    assert (a["specimen"], b["specimen"], a["specimen_name"]) == (0, 0, "A")
    assert np.isnan(c["specimen"])
    assert {note["code"] for note in json.loads(a["notes"])} >= {"mesh-present", "whole-revolutions"}


def test_one_average_is_that_of_the_signature_with_its_noise_and_features(folder, listed, settings_with, tmp_path):
    """The row has the numbers of ``sigdb signature``, in the float32 of a database."""
    whole = settings_with(averages=None, channels=("a1",))
    ingest(listed, tmp_path / "db", settings=whole, jobs=1)
    database = sigdb.open(tmp_path / "db")
    (row,) = database.features().to_dict("records")
    signature = recorded_signature(
        read_recording(folder / "m1-a.npz", tacho="tacho", sampling_rate=8192.0), teeth=12, channel="a1"
    )
    signals = database.batches(table="signals").read_all().to_pylist()[0]
    g = 9.80665
    np.testing.assert_allclose(signals["tsa"], g * signature.tsa, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(signals["noise"], g * signature.noise, rtol=1e-6)
    np.testing.assert_allclose(np.reshape(signals["groups"], signature.groups.shape), g * signature.groups, atol=1e-5)
    assert row["scatter"] == pytest.approx(g * signature.scatter, rel=1e-6)
    assert row["unit"] == "m/s^2"
    expected = features(g * signature.tsa, teeth=12)
    for name, feature in FEATURES.items():
        stored = signals[name] if "order" in feature.axes else row[name]
        np.testing.assert_allclose(stored, np.ravel(expected[name]) if feature.axes else expected[name], rtol=2e-5)


def test_a_part_without_receipt_is_made_again_and_no_other(folder, settings, copy):
    before = {path: path.stat().st_mtime_ns for path in copy.rglob("*.parquet")}
    content = parts(copy)
    (copy / "receipts" / "rows-00001.json").unlink()
    assert ingest(folder, copy, settings=settings, jobs=1).new_recordings == 1
    assert parts(copy) == content
    again = {path.name for path, time in before.items() if path.stat().st_mtime_ns != time}
    assert again == {"part-00001.parquet"}
    assert ingest(folder, copy, settings=settings, jobs=1).new_recordings == 0


def test_an_unfinished_database_is_read_as_far_as_it_is(copy):
    (copy / "receipts" / "rows-00000.json").unlink()
    database = sigdb.open(copy)
    assert len(database) == 9
    assert database.lacks == "3 of 4 parts"


def test_new_files_extend_a_database_and_touch_no_old_part(folder_copy, settings, write_recording, tmp_path):
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    old = parts(tmp_path / "db")
    write_recording(folder_copy / "m3.npz", seed=9)
    with (folder_copy / "recordings.csv").open("a", encoding="utf-8") as table:
        table.write("m3.npz,m3,2026-03-02,50,,,,,B\n")
    summary = ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    assert (summary.new_recordings, summary.recordings, summary.rows) == (1, 5, 17)
    new = parts(tmp_path / "db")
    assert {path: new[path] for path in old} == old
    rows = sigdb.open(tmp_path / "db").cases("machine = 'm3'")
    assert rows["specimen"].tolist() == [1] * 4
    assert rows["id"].tolist() == [4 * 65536 + i for i in range(4)]
    assert sigdb.open(tmp_path / "db").signals(rows["id"])["tsa"].shape == (4, 12 * 64)


def test_a_link_to_nothing_is_a_row_without_result(folder_copy, settings, tmp_path):
    (folder_copy / "lost.npz").symlink_to(tmp_path / "nowhere.npz")
    (folder_copy / "recordings.csv").unlink(missing_ok=True)
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    (row,) = sigdb.open(tmp_path / "db").cases("recording = 'lost.npz'").to_dict("records")
    assert row["status_code"] == "unreadable"
    assert "no such file" in row["status"]
    assert verify(tmp_path / "db") == ()


def test_an_ingested_file_that_has_changed_is_refused(folder_copy, settings, tmp_path):
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    (folder_copy / "broken.npz").write_bytes(b"longer than it was before, and no archive")
    with pytest.raises(InputError, match=r"broken\.npz: has 41 bytes, and had 15 when it was ingested"):
        ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)


@pytest.mark.parametrize(
    ("changes", "code", "reason"),
    [
        ({"averages": 100}, "no_average", "averages of 100 revolutions need at least as many"),
        ({"teeth": "13"}, "no_gear", "no mesh of 13 teeth stands out"),
        ({"averaging": {"speed_rpm": 2000.0}}, "doubtful", "accept the doubt speed-unlike-rig"),
        ({"channels": ("a9",)}, "no_average", "no channel 'a9'"),
        ({"teeth": None}, "no_average", "teeth is missing"),
        ({"teeth": "12/36", "gears": ("whel",)}, "no_average", "whel"),
        ({"reading": {}}, "unreadable", "sampling rate"),
    ],
)
def test_what_is_not_sure_is_a_row_without_result(listed, settings_with, tmp_path, changes, code, reason):
    ingest(listed, tmp_path / "db", settings=settings_with(**changes), jobs=1)
    rows = sigdb.open(tmp_path / "db").cases()
    assert set(rows["status_code"]) == {code}
    assert reason in rows["status"][0]
    assert rows["rms"].isna().all()


def test_an_accepted_doubt_is_a_result_with_a_note(listed, settings_with, tmp_path):
    settings = settings_with(averaging={"speed_rpm": 2000.0}, accept=("speed-unlike-rig",))
    ingest(listed, tmp_path / "db", settings=settings, jobs=1)
    rows = sigdb.open(tmp_path / "db").cases()
    assert set(rows["status"]) == {"ok"}
    assert "speed-unlike-rig" in rows["notes"][0]


def test_several_gears_of_a_rig_are_averaged_each_over_its_own_shaft(listed, settings_with, tmp_path):
    """The tacho is on the pinion's shaft, which turns three times in a turn of the gear of 36 teeth."""
    settings = settings_with(teeth="12/36", gears=("pinion", "wheel"), channels=("a1",), averages=15)
    ingest(listed, tmp_path / "db", settings=settings, jobs=1)
    rows = sigdb.open(tmp_path / "db").cases("draw = 0").set_index("gear")
    assert set(rows["status"]) == {"ok"}
    assert rows["teeth"].to_dict() == {"pinion": 12, "wheel": 36}
    assert rows["shaft_rpm"].to_dict() == pytest.approx({"pinion": 1200, "wheel": 400}, rel=1e-4)
    np.testing.assert_allclose(rows["speed_rpm"], 1200, rtol=1e-4)


@pytest.mark.parametrize("gears", [("pinion", "whel"), ("whel", "pinion")])
def test_a_gear_that_the_rig_lacks_is_a_row_without_result_beside_the_others(listed, settings_with, tmp_path, gears):
    settings = settings_with(teeth="12/36", gears=gears, channels=("a1",), averages=None)
    ingest(listed, tmp_path / "db", settings=settings, jobs=1)
    rows = sigdb.open(tmp_path / "db").cases().set_index("gear")
    assert rows["status_code"].to_dict() == {"pinion": "ok", "whel": "no_average"}


def test_another_length_of_averages_is_refused(folder, copy, settings_with):
    with pytest.raises(InputError, match="has averages of 64 samples a tooth, not of 32"):
        ingest(folder, copy, settings=settings_with(samples_per_tooth=32), jobs=1)


def test_a_database_of_a_sweep_is_refused(folder, of_a_sweep, settings):
    with pytest.raises(InputError, match="is the database of a sweep"):
        ingest(folder, of_a_sweep, settings=settings, jobs=1)


def test_templates_are_an_empty_table(made):
    database = sigdb.open(made)
    assert database.sql("select count(*) as n from templates")["n"].tolist() == [0]
    assert len(database.templates()) == 0


def test_an_object_store_holds_the_same_files_and_is_extended(folder, settings, made, tmp_path):
    """A file system in memory, without locks and renaming, as an object store."""
    filesystem = fs.PyFileSystem(fs.FSSpecHandler(fsspec.filesystem("memory")))
    store = Store(location="memory://bucket/db", filesystem=filesystem, root="/bucket/db")
    ingest(folder, store, settings=settings, jobs=1)
    here = {n: Store.at(made).get(n) for n in Store.at(made).sizes()}
    assert {name: store.get(name) for name in store.sizes() if name.endswith("parquet")} == {
        name: content for name, content in here.items() if name.endswith("parquet")
    }
    assert set(store.sizes()) == set(here) - {".lock"}
    assert len(sigdb.open(store)) == 13
    assert verify(store, deep=True, sample=1) == ()
    (tmp_path / "findings.csv").write_text("date,machine,tooth\n2026-06-01,m2,3\n", encoding="utf-8")
    assert enter_findings(store, tmp_path / "findings.csv") == 5
    assert verify(store) == ()


def test_facts_of_earlier_recordings_are_not_read_again(folder_copy, settings, copy, write_recording, monkeypatch):
    ingest(folder_copy, copy, settings=settings, jobs=1)  # the copies of the files are new ones
    write_recording(folder_copy / "m2-b.npz", seed=9)
    with (folder_copy / "recordings.csv").open("a", encoding="utf-8") as table:
        table.write("m2-b.npz\n")
    read, original = [], recording_table.facts_of
    monkeypatch.setattr(
        recording_table,
        "facts_of",
        lambda values, *rest, **more: read.append(values) or original(values, *rest, **more),
    )
    assert ingest(folder_copy, copy, settings=settings, jobs=1).new_recordings == 1
    assert [values["file"] for values in read] == ["m2-b.npz"]
