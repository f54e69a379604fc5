"""Unit: moved recordings are recognised by their SHA-256, and no row of them is made again."""

import shutil

import pytest

from sigdb.ingest import ingest, verify


@pytest.fixture
def moved(folder_copy, settings, tmp_path):
    """A folder that was renamed after its ingest, and the files of its database before."""
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    return folder_copy.rename(tmp_path / "archive"), parts(tmp_path / "db")


def parts(database):
    return {path.name: path.read_bytes() for name in ("features", "receipts") for path in (database / name).iterdir()}


def test_a_moved_folder_has_its_rows_and_a_new_file_is_added(moved, settings, write_recording, tmp_path):
    archive, before = moved
    assert {each.kind for each in verify(tmp_path / "db", deep=True)} == {"damage"}
    write_recording(archive / "m3.npz", seed=9)
    with (archive / "recordings.csv").open("a", encoding="utf-8") as table:
        table.write("m3.npz,m3,2026-03-02,50,,,,,B\n")
    summary = ingest(archive, tmp_path / "db", settings=settings, jobs=1)
    assert (summary.moved, summary.new_recordings, summary.recordings) == (4, 1, 5)
    assert before.items() <= parts(tmp_path / "db").items()
    assert verify(tmp_path / "db", deep=True) == ()
    again = ingest(archive, tmp_path / "db", settings=settings, jobs=1)
    assert (again.moved, again.new_recordings) == (0, 0)


def test_a_recording_may_move_again_and_back(moved, settings, tmp_path):
    archive, before = moved
    for place in ("elsewhere", "recordings"):
        archive = archive.rename(tmp_path / place)
        summary = ingest(archive, tmp_path / "db", settings=settings, jobs=1)
        assert (summary.moved, summary.new_recordings) == (4, 0)
    assert parts(tmp_path / "db") == before
    assert verify(tmp_path / "db", deep=True) == ()


def test_a_copy_and_another_recording_of_the_same_size_are_new(folder_copy, settings, write_recording, tmp_path):
    ingest(folder_copy, tmp_path / "db", settings=settings, jobs=1)
    (tmp_path / "more").mkdir()
    shutil.copy(folder_copy / "m1-a.npz", tmp_path / "more" / "copy.npz")
    (folder_copy / "m1-b.npz").unlink()
    write_recording(tmp_path / "more" / "other.npz", seed=5)
    summary = ingest(tmp_path / "more", tmp_path / "db", settings=settings, jobs=1)
    assert (summary.moved, summary.new_recordings) == (0, 2)
