"""Unit: files of a store are there whole or not at all; sealed and checked ones let no byte change unnoticed."""

import hashlib
import io
import json
import os
import tomllib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import fs

from sigdb.core.errors import CorruptionError, DatabaseError, InputError
from sigdb.database.store import checked
from sigdb.database.store.checked import CheckedParquet, block_checksums
from sigdb.database.store.receipts import FileRecord
from sigdb.database.store.seal import sealed_json, sealed_toml, unsealed
from sigdb.database.store.store import Store


@pytest.fixture(params=["directory", "other"])
def store(request, tmp_path):
    """A directory, and a file system that is not taken for one, as an object store is not."""
    if request.param == "directory":
        return Store.at(tmp_path)
    (tmp_path / "place" / "a").mkdir(parents=True)
    return Store(
        location="mem://place", filesystem=fs.SubTreeFileSystem(str(tmp_path), fs.LocalFileSystem()), root="place"
    )


def test_what_is_put_is_got(store):
    content = bytes(range(256)) * 10
    store.put("a/file", content)
    store.put("other", memoryview(b"12"))
    assert store.get("a/file") == content
    assert store.get_range("a/file", 256, 5) == content[256:261]
    assert store.get_range("a/file", 2558, 100) == content[2558:]
    assert (store.size("a/file"), store.size("none"), store.size("a")) == (2560, None, None)
    assert store.sizes() == {"a/file": 2560, "other": 2}
    assert store.sizes("a") == {"a/file": 2560}
    assert store.sizes("none") == {}
    store.put("other", b"3")
    assert store.get("other") == b"3"
    for _ in range(2):
        store.delete("other")
    assert store.sizes() == {"a/file": 2560}


@pytest.mark.parametrize("read", [lambda store: store.get("none"), lambda store: store.get_range("none", 0, 1)])
def test_a_missing_file(store, read):
    with pytest.raises(CorruptionError, match=r"none is missing"):
        read(store)


def test_a_folder_that_is_made_while_it_is_listed(tmp_path):
    """Arrow looks for a missing folder, and then whether it is missing: in between a sweep may make it."""

    class Listing:
        def __init__(self):
            self.looks = 0

        def get_file_info(self, selector):
            self.looks += 1
            if self.looks == 1:
                (tmp_path / "receipts").mkdir()
                (tmp_path / "receipts" / "rows-00000.json").write_bytes(b"12")
                raise FileNotFoundError(2, "No such file or directory")
            return fs.LocalFileSystem().get_file_info(selector)

    store = Store(location="place", filesystem=Listing(), root=str(tmp_path))
    assert store.sizes("receipts") == {"receipts/rows-00000.json": 2}


def test_temporary_files_are_not_listed_but_known(tmp_path):
    store = Store.at(tmp_path)
    store.put("a/part-00000.parquet", b"1")
    for name in (".part-00000.parquet.12.ab.tmp", "a/.part-00000.parquet.12.ab.tmp"):
        (tmp_path / name).write_bytes(b"half")
    (tmp_path / "a" / "notes.tmp").write_bytes(b"mine")
    assert list(store.sizes()) == ["a/notes.tmp", "a/part-00000.parquet"]
    assert store.temporary() == [".part-00000.parquet.12.ab.tmp", "a/.part-00000.parquet.12.ab.tmp"]
    store.clear_temporary()
    assert store.temporary() == []
    assert list(store.sizes()) == ["a/notes.tmp", "a/part-00000.parquet"]


def test_at_every_instant_a_file_is_whole(tmp_path, monkeypatch):
    """Old content until the new is durable and renamed: seen just before each system call that changes something."""
    store = Store.at(tmp_path)
    store.put("file", b"old")
    seen = []
    for name in ("fsync", "replace"):
        called = getattr(os, name)

        def watched(*arguments, called=called, name=name):
            seen.append((name, store.get("file")))
            return called(*arguments)

        monkeypatch.setattr(os, name, watched)
    store.put("file", b"new")
    assert seen == [("fsync", b"old"), ("replace", b"old"), ("fsync", b"new")]


@pytest.mark.parametrize(
    ("call", "error"),
    [("replace", PermissionError(13, "Permission denied")), ("fsync", OSError(28, "No space left on device"))],
)
def test_what_cannot_be_written_is_told(tmp_path, monkeypatch, call, error):
    store = Store.at(tmp_path)
    store.put("file", b"old")

    def fail(*arguments):
        raise error

    monkeypatch.setattr(os, call, fail)
    says = (
        rf"file: cannot be written \({error.strerror}\); nothing that is finished is lost; make room or give the right"
    )
    with pytest.raises(DatabaseError, match=says):
        store.put("file", b"new")
    assert store.get("file") == b"old"
    assert store.temporary() == []


def test_places(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    store = Store.at("db")
    assert (str(store), store.folder) == ("db", tmp_path / "db")
    assert store.name_of("a/b") == "db/a/b"
    assert Store.at(store) is store
    assert Store.at(tmp_path / "db").root == store.root
    remote = Store(
        location="s3://bucket/db?region=x", filesystem=fs.SubTreeFileSystem("/", fs.LocalFileSystem()), root="db"
    )
    assert remote.folder is None
    assert remote.name_of("a/b") == "s3://bucket/db/a/b"
    with pytest.raises(
        InputError, match=r"ftp://place: not a place for a database .*; give a directory or s3://BUCKET"
    ):
        Store.at("ftp://place")


CONTENT = {"a": 1, "text": 'two\nlines "quoted" \\ µ', "numbers": [0.1, 2.0], "inner": {"x": True}}


@pytest.mark.parametrize(
    ("name", "seal", "load"), [("a.toml", sealed_toml, tomllib.loads), ("a.json", sealed_json, json.loads)]
)
def test_a_sealed_file_holds_its_content_and_is_readable_without_us(name, seal, load):
    text = seal(CONTENT)
    assert unsealed(text, name=name) == CONTENT
    _, rest = text.split(b"\n", 1)
    plain = load(text.decode())
    assert plain.pop("sha256") == hashlib.sha256(rest).hexdigest()
    assert plain == CONTENT


@pytest.mark.parametrize(("name", "seal"), [("a.toml", sealed_toml), ("a.json", sealed_json)])
def test_every_flipped_bit_of_a_sealed_file_is_found(name, seal):
    text = seal(CONTENT)
    for bit in range(8 * len(text)):
        flipped = bytearray(text)
        flipped[bit // 8] ^= 1 << bit % 8
        with pytest.raises(CorruptionError, match=rf"{name} is damaged or was edited"):
            unsealed(bytes(flipped), name=name)
    for other in (b"", text[:-1], text + b"\n", text.replace(b"\n", b"\r\n"), text.split(b"\n", 1)[1]):
        with pytest.raises(CorruptionError, match=r"is damaged or was edited"):
            unsealed(other, name=name)


@pytest.fixture
def parquet(tmp_path):
    """A small file of a part, and its record."""
    table = pa.table({"id": np.arange(50), "x": np.arange(50) / 7, "s": [str(i % 3) for i in range(50)]})
    pq.write_table(table, tmp_path / "file", compression="zstd")
    content = (tmp_path / "file").read_bytes()
    record = FileRecord(path="file", bytes=len(content), sha256="", blocks=block_checksums(memoryview(content)))
    return table, content, record


def test_every_flipped_byte_of_a_parquet_file_is_an_error_when_it_is_read(tmp_path, parquet):
    table, content, record = parquet
    store, rng = Store.at(tmp_path), np.random.default_rng(1)
    assert CheckedParquet(store, record).read().equals(table)
    for offset in range(len(content)):
        flipped = bytearray(content)
        flipped[offset] ^= 1 << int(rng.integers(8))
        (tmp_path / "file").write_bytes(flipped)
        with pytest.raises(
            CorruptionError, match=r"file is damaged: bytes 0 to \d+ are not as they were written; make it"
        ):
            CheckedParquet(store, record).read()


@pytest.mark.parametrize("cut", [0, 1, 100, -1, None])
def test_a_file_of_another_length_is_an_error_when_it_is_read(tmp_path, parquet, cut):
    _, content, record = parquet
    (tmp_path / "file").write_bytes(content + b"\0" if cut is None else content[:cut])
    with pytest.raises(CorruptionError, match=r"file is damaged"):
        CheckedParquet(Store.at(tmp_path), record).read()


def test_blocks_that_are_read_are_checked_and_no_others(tmp_path):
    content = np.random.default_rng(2).bytes(1000)
    record = FileRecord(path="file", bytes=1000, sha256="", blocks=block_checksums(memoryview(content), 64), block=64)
    damaged = bytearray(content)
    damaged[200] ^= 1  # in the block of bytes 192 to 255
    (tmp_path / "file").write_bytes(damaged)
    file = checked._CheckedFile(Store.at(tmp_path), record)
    for start, stop in ((0, 192), (256, 1000), (300, 301), (990, 1000), (5, 5)):
        file.seek(start)
        assert file.read(stop - start) == content[start:stop]
        assert file.tell() == stop
    for start, stop in ((0, 193), (255, 256), (100, 900), (0, 1000)):
        file.seek(start)
        with pytest.raises(CorruptionError, match=r"bytes 192 to 255 are not as they were written"):
            file.read(stop - start)
    assert file.seek(-10, io.SEEK_END) == 990
    assert file.read() == content[990:]
    assert file.read(5) == b""
    assert file.seek(256) == 256
    assert file.seek(4, io.SEEK_CUR) == 260
    assert file.read(-1) == content[260:]


def test_a_file_is_put_where_folders_cannot_be_opened_and_read_only_files_not_flushed(tmp_path, monkeypatch):
    """As on Windows."""
    opened, flushed, open_file, flush = [], [], os.open, os.fsync

    def open_as_windows(path, flags, *options, **names):
        if os.path.isdir(path):  # noqa: PTH112
            opened.append(path)
            raise PermissionError(13, "Permission denied", str(path))
        return open_file(path, flags, *options, **names)

    def flush_as_windows(descriptor):
        os.write(descriptor, b"")  # fails on a descriptor that was opened for reading only
        flushed.append(descriptor)
        flush(descriptor)

    monkeypatch.setattr(os, "open", open_as_windows)
    monkeypatch.setattr(os, "fsync", flush_as_windows)
    Store.at(tmp_path).put("a/file", b"content")
    assert (tmp_path / "a" / "file").read_bytes() == b"content"
    assert opened == [tmp_path, tmp_path / "a"]
    assert len(flushed) == 1
