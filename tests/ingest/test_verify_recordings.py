"""Unit: verification finds every flipped byte and every changed recording, and repair makes parts again."""

import numpy as np
import pytest

from sigdb.ingest import ingest, repair, verify


def test_a_whole_database_has_no_findings(made):
    assert verify(made, deep=True) == ()


@pytest.mark.parametrize(
    "name",
    [
        "features/part-00000.parquet",
        "signals/part-00001.parquet",
        "receipts/rows-00002.json",
        "schema.json",
        "sigdb.toml",
        "recordings/list-00000.json",
    ],
)
def test_a_flipped_byte_is_found_and_repaired_where_it_can_be(copy, name):
    content = bytearray((copy / name).read_bytes())
    content[len(content) // 2] ^= 1
    (copy / name).write_bytes(content)
    (finding,) = verify(copy)
    assert finding.kind == "damage"
    mended = repair(copy, jobs=1)
    is_description = name in ("sigdb.toml", "recordings/list-00000.json")
    assert bool(mended.left) == is_description


def test_what_is_missing_and_what_is_foreign_is_found(copy):
    (copy / "receipts" / "rows-00001.json").unlink()
    (copy / "notes.txt").write_text("mine", encoding="utf-8")
    kinds = sorted(finding.kind for finding in verify(copy))
    assert kinds == ["foreign", "unfinished"]
    assert [finding.kind for finding in repair(copy, jobs=1).left] == ["foreign"]


def test_deep_reads_the_recordings_again(folder_copy, settings, tmp_path):
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    with np.load(folder_copy / "m1-b.npz") as stored:
        channels = {name: stored[name] for name in stored}
    channels["a1"][1000] += 1e-3
    np.savez(folder_copy / "m1-b.npz", **channels)
    (folder_copy / "m1-a.npz").unlink()
    assert verify(tmp_path / "db") == ()
    found = {finding.file.rpartition("/")[2]: finding.what for finding in verify(tmp_path / "db", deep=True)}
    assert found == {
        "m1-a.npz": "is gone",
        "m1-b.npz": "is not the file that was ingested: its SHA-256 is another one",
    }


def test_a_damaged_part_whose_recording_is_gone_is_left_as_it_is(folder_copy, settings, tmp_path):
    """Made again, its rows would have no result any more."""
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    name = tmp_path / "db" / "features" / "part-00001.parquet"
    name.write_bytes(name.read_bytes()[:-1] + b"x")
    kept = name.read_bytes()
    (folder_copy / "m1-b.npz").unlink()
    left = repair(tmp_path / "db", jobs=1).left
    assert [(finding.kind, finding.part) for finding in left] == [("damage", 1)]
    assert name.read_bytes() == kept
