"""A database that grows by single ingests keeps a short description, and its lists are compared. Evidence: unit."""

import tomllib

import numpy as np
import pytest

import sigdb
from sigdb.ingest import IngestSettings, ingest, verify
from sigdb.ingest.plan import IngestPlan

TEETH, EACH = 8, 16


def added(folder, number, **settings):
    """Ingest one more file with an average; the numbers are its own."""
    (folder / "averages").mkdir(exist_ok=True)
    tsa = np.random.default_rng(number).normal(size=(1, TEETH * EACH))
    np.savez(folder / "averages" / f"r{number}.npz", tsa=tsa)
    stated = {"teeth": str(TEETH), "averages_of": "tsa", "samples_per_tooth": EACH} | settings
    return ingest(folder / "averages", folder / "db", settings=IngestSettings(**stated), jobs=1)


def described(folder):
    return tomllib.loads((folder / "db" / "sigdb.toml").read_text(encoding="utf-8"))


def test_single_ingests_of_the_same_settings_are_one_plan(tmp_path):
    added(tmp_path, 0)
    first = described(tmp_path)
    sizes = []
    for number in range(1, 5):
        assert added(tmp_path, number).new_recordings == 1
        sizes.append((tmp_path / "db" / "sigdb.toml").stat().st_size)
    assert len(set(sizes)) == 1
    now = described(tmp_path)
    assert (now["plan"]["hash"], now["plan"]["parts"], now["extensions"]) == (first["plan"]["hash"], 5, [])
    rows = sigdb.open(tmp_path / "db").cases()
    assert rows["id"].tolist() == [65536 * part for part in range(5)]
    assert rows["recording"].tolist() == [f"r{number}.npz" for number in range(5)]
    assert verify(tmp_path / "db", deep=True) == ()
    assert added(tmp_path, 0).new_recordings == 0


def test_other_settings_are_another_plan_which_grows_in_its_turn(tmp_path):
    added(tmp_path, 0)
    for number in (1, 2):
        added(tmp_path, number, teeth="4/8", gears=("wheel",))
    added(tmp_path, 3)
    now = described(tmp_path)
    assert [plan["parts"] for plan in (now["plan"], *now["extensions"])] == [1, 2, 1]
    assert verify(tmp_path / "db", deep=True) == ()


def test_plans_that_were_appended_before_are_read_and_the_last_one_grows(tmp_path, monkeypatch):
    with monkeypatch.context() as before:
        before.setattr(IngestPlan, "is_alike", lambda *plans: False)
        for number in range(3):
            added(tmp_path, number)
    assert len(described(tmp_path)["extensions"]) == 2
    added(tmp_path, 3)
    assert [plan["parts"] for plan in described(tmp_path)["extensions"]] == [1, 2]
    assert verify(tmp_path / "db", deep=True) == ()


def test_a_part_that_is_lost_is_made_again_whichever_list_it_is_of(tmp_path):
    for number in range(3):
        added(tmp_path, number)
    before = sigdb.open(tmp_path / "db").cases()
    (tmp_path / "db" / "receipts" / "rows-00001.json").unlink()
    assert [each.kind for each in verify(tmp_path / "db")] == ["unfinished"]
    assert added(tmp_path, 2).new_recordings == 1
    assert sigdb.open(tmp_path / "db").cases().equals(before)


@pytest.mark.parametrize(("copied", "over"), [(1, 2), (2, 1), (2, 0)])
def test_the_list_of_other_recordings_is_found(tmp_path, copied, over):
    for number in range(3):
        added(tmp_path, number)
    one, other = (tmp_path / "db" / "recordings" / f"list-{number:05d}.json" for number in (copied, over))
    other.write_bytes(one.read_bytes())
    (finding,) = verify(tmp_path / "db")
    assert "recordings that sigdb.toml names" in finding.what


def test_files_of_one_name_in_two_folders_move_each_to_its_place(tmp_path):
    """Names are below the folder of an ingest, and two folders are of one plan."""
    for place, number in (("x", 0), ("y", 1)):
        (tmp_path / place).mkdir()
        np.savez(tmp_path / place / "r.npz", tsa=np.random.default_rng(number).normal(size=(1, TEETH * EACH)))
        settings = IngestSettings(teeth=str(TEETH), averages_of="tsa", samples_per_tooth=EACH)
        ingest(tmp_path / place, tmp_path / "db", settings=settings, jobs=1)
    assert described(tmp_path)["extensions"] == []
    (tmp_path / "y").rename(tmp_path / "a")
    (tmp_path / "x").rename(tmp_path / "b")
    for place in ("b", "a"):
        assert ingest(tmp_path / place, tmp_path / "db", settings=settings, jobs=1).moved == 1
    assert verify(tmp_path / "db", deep=True) == ()
