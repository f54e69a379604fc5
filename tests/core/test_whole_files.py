"""Unit: files are written whole or not at all; of several, the last one never stands among files of another time."""

import os
import time

import pytest

from sigdb.core import TEMPORARY, publish, publish_all


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("content", ["µm", "µm".encode(), lambda path: path.write_text("µm", encoding="utf-8")])
def test_a_file_is_written_into_a_new_folder(tmp_path, content):
    publish(tmp_path / "a" / "file", content)
    assert (tmp_path / "a" / "file").read_text(encoding="utf-8") == "µm"
    assert names(tmp_path / "a") == ["file"]


def test_a_failure_leaves_the_old_file_and_names_it(tmp_path):
    (tmp_path / "file").write_text("old")

    def full(path):
        path.write_text("ne")
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left") as failed:
        publish(tmp_path / "file", full)
    assert failed.value.filename == str(tmp_path / "file")
    assert (tmp_path / "file").read_text() == "old"
    assert names(tmp_path) == ["file"]


@pytest.mark.parametrize("fails", [1, 2])
def test_the_last_of_several_files_is_absent_while_the_others_change(tmp_path, monkeypatch, fails):
    """A rename fails: before the first one nothing has changed, after it the last file does not stand."""
    old, new = ({tmp_path / name: f"{time} {name}" for name in ("numbers", "page")} for time in ("old", "new"))
    publish_all(old)
    replace, renamed = os.replace, []

    def failing(source, target):
        renamed.append(target)
        if len(renamed) == fails:
            raise PermissionError(13, "Permission denied")
        replace(source, target)

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(PermissionError):
        publish_all(new)
    assert names(tmp_path) == ["numbers"]
    monkeypatch.undo()
    publish_all(new)
    assert {path: path.read_text() for path in new} == new


def test_a_link_is_followed_and_a_device_is_written_to(tmp_path):
    (tmp_path / "target").write_text("old")
    (tmp_path / "link").symlink_to("target")
    publish(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "new"
    publish(tmp_path / "device", "new") if os.name == "nt" else (tmp_path / "device").symlink_to(os.devnull)
    publish(tmp_path / "device", "gone")
    assert names(tmp_path) == ["device", "link", "target"]


def test_what_a_stopped_process_left_a_day_ago_is_deleted(tmp_path):
    """A younger one may be of a process that still writes."""
    for name, age in (("old", 25 * 3600), ("young", 60)):
        left = tmp_path / f".file.{name}{TEMPORARY}"
        left.write_text("half")
        os.utime(left, (time.time() - age,) * 2)
    publish(tmp_path / "file", "whole")
    assert names(tmp_path) == [f".file.young{TEMPORARY}", "file"]


def test_the_name_of_each_new_folder_is_flushed_in_the_folder_above(tmp_path, monkeypatch):
    flushed = []
    monkeypatch.setattr("sigdb.core.whole_files._sync_folder", flushed.append)
    publish(tmp_path / "a" / "db" / "receipts" / "one.json", b"x")
    assert flushed == [tmp_path, tmp_path / "a", tmp_path / "a" / "db", tmp_path / "a" / "db" / "receipts"]
    flushed.clear()
    publish(tmp_path / "a" / "db" / "receipts" / "two.json", b"x")
    assert flushed == [tmp_path / "a" / "db" / "receipts"]
