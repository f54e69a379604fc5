"""Unit: one sweep at a time on a place, in a directory and where the operating system knows no locks."""

import json
import os
import socket
import subprocess
import sys
import time

import pytest
from pyarrow import fs

from sigdb.core.errors import DatabaseError
from sigdb.database.store.store import Store
from sigdb.sweep.work import ownership
from sigdb.sweep.work.ownership import LOCK, OWNER, ownership_of

ME = f"process {os.getpid()} on {socket.gethostname()}"


@pytest.fixture
def directory(tmp_path):
    return Store.at(tmp_path / "db")


@pytest.fixture
def remote(tmp_path):
    """A file system that is not taken for a directory, as an object store is not."""
    (tmp_path / "place").mkdir()
    return Store(
        location="mem://place", filesystem=fs.SubTreeFileSystem(str(tmp_path), fs.LocalFileSystem()), root="place"
    )


def owner_of(store):
    return json.loads(store.get(OWNER))


@pytest.mark.parametrize("kind", ["directory", "remote"])
def test_a_second_owner_is_refused_with_the_first_ones_name(kind, request):
    store = request.getfixturevalue(kind)
    with ownership_of(store):
        for _ in range(2):
            with (
                pytest.raises(DatabaseError, match=rf"a sweep is already running on it \({ME}\); wait until it ends"),
                ownership_of(store),
            ):
                pass
        assert owner_of(store)["process"] == os.getpid()
    assert store.size(OWNER) is None
    with ownership_of(store):
        pass


def test_the_lock_of_another_process_is_respected_until_it_dies(directory):
    holds = "import filelock, sys; lock = filelock.FileLock(sys.argv[1]); lock.acquire(); print('held'); input()"
    line = [sys.executable, "-u", "-c", holds, str(directory.folder / LOCK)]
    directory.folder.mkdir()
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(DatabaseError, match="already running on it"), ownership_of(directory):
            pass
        other.kill()
    with ownership_of(directory):
        pass


@pytest.mark.parametrize("kind", ["directory", "remote"])
def test_a_place_is_free_again_after_an_error(kind, request):
    store = request.getfixturevalue(kind)
    with pytest.raises(KeyboardInterrupt), ownership_of(store):
        raise KeyboardInterrupt
    with ownership_of(store):
        pass
    assert store.size(OWNER) is None


def left_by(store, age, **other):
    store.put(
        OWNER, json.dumps({"process": 12, "host": "far", "alive": time.time() - age, "token": "x"} | other).encode()
    )


def test_a_refusal_says_how_long_a_killed_sweep_counts(remote):
    left_by(remote, age=1)
    says = r"if it was killed, its last sign of life counts for 90 s"
    with pytest.raises(DatabaseError, match=says), ownership_of(remote):
        pass


@pytest.mark.parametrize("age", [-86400.0, -91.0, 1e9, float("nan")])
def test_a_sign_of_life_from_another_time_does_not_block(remote, age):
    """Nor does that of a clock that was ahead."""
    left_by(remote, age=age)
    with ownership_of(remote):
        assert owner_of(remote)["process"] == os.getpid()


@pytest.mark.parametrize("alive", ["soon", None, [1], {}, True])
def test_nor_does_one_that_is_no_number(remote, alive):
    left_by(remote, age=0, alive=alive)
    with ownership_of(remote):
        assert owner_of(remote)["process"] == os.getpid()


def test_a_sign_of_life_that_is_old_is_a_dead_owners(remote):
    left_by(remote, age=60)
    with pytest.raises(DatabaseError, match=r"already running on it \(process 12 on far\)"), ownership_of(remote):
        pass
    assert owner_of(remote)["token"] == "x"
    left_by(remote, age=120)
    with ownership_of(remote):
        assert owner_of(remote)["process"] == os.getpid()


@pytest.mark.parametrize("left", [b"", b"{", b"[]", b"process 1 on another\n", b"{}", b'{"process": 1}', b"3"])
@pytest.mark.parametrize("kind", ["directory", "remote"])
def test_an_owner_that_cannot_be_read_does_not_block(kind, left, request, tmp_path):
    store = request.getfixturevalue(kind)
    (tmp_path / "db").mkdir()
    store.put(OWNER, left)
    with ownership_of(store):
        assert owner_of(store)["process"] == os.getpid()


def test_the_sign_of_life_is_renewed(remote, monkeypatch):
    monkeypatch.setattr(ownership, "_BEAT", 0.01)
    with ownership_of(remote):
        first = owner_of(remote)
        deadline = time.monotonic() + 10
        # This file system does not write at once, as an object store does: what is half there is no owner.
        while (ownership._owner(remote) or first)["alive"] == first["alive"]:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        assert (ownership._owner(remote) or first)["token"] == first["token"]
    time.sleep(0.05)
    assert remote.size(OWNER) is None


def test_of_two_that_begin_at_once_the_last_to_sign_goes_on(remote, monkeypatch):
    """Another one signs between this one's look and its second look."""
    put = Store.put

    def put_then_another(self, name, content):
        put(self, name, content)
        monkeypatch.setattr(Store, "put", put)
        left_by(self, age=0)

    monkeypatch.setattr(Store, "put", put_then_another)
    with pytest.raises(DatabaseError, match=r"already running on it \(process 12 on far\)"), ownership_of(remote):
        pass
    assert owner_of(remote)["token"] == "x"


def test_a_place_that_cannot_be_owned(tmp_path):
    """A file where the directory should be, and a directory where the lock should be."""
    (tmp_path / "file").write_bytes(b"")
    (tmp_path / "db" / ".lock").mkdir(parents=True)
    for place in (tmp_path / "file", tmp_path / "file" / "db", tmp_path / "db"):
        with (
            pytest.raises(DatabaseError, match=r"cannot be written \(.*\); nothing that is finished is lost"),
            ownership_of(Store.at(place)),
        ):
            pass
