"""Ownership of a database: one sweep at a time."""

import json
import os
import secrets
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypedDict, cast

from filelock import FileLock, Timeout

from sigdb.core import DatabaseError, make_folder
from sigdb.database import Store

OWNER, LOCK = ".owner", ".lock"
_BEAT, _STALE = 20.0, 90.0
"""Seconds between signs of life in an object store, and without one until an owner counts as dead."""


class Owner(TypedDict):
    """Content of the file of an owner: its process, its host, the time of its last sign of life, and a token."""

    process: int
    host: str
    alive: float
    token: str


@contextmanager
def ownership_of(store: Store) -> Iterator[None]:
    """Own a database's place while a sweep runs on it.

    The operating system locks a directory and releases the lock when its owner dies. An object store has no locks: its
    owner leaves a sign of life, which grows old when the owner has died. If two sweeps begin there at the same instant,
    both write the same bytes.

    Raises
    ------
    DatabaseError
        If another sweep is running on it, or it cannot be written.
    """
    with _locked(store, store.folder) if store.folder is not None else _signed(store):
        yield


@contextmanager
def _locked(store: Store, folder: Path) -> Iterator[None]:
    lock = FileLock(folder / LOCK)
    try:
        make_folder(folder)
        lock.acquire(timeout=0)
    except Timeout:
        raise _busy(store, _owner(store)) from None
    except OSError as error:
        raise DatabaseError(
            f"{store}: cannot be written ({error.strerror or error}); nothing that is finished is lost"
        ) from None
    try:
        store.put(OWNER, _signature())
        yield
    finally:
        (folder / OWNER).unlink(missing_ok=True)
        lock.release()


@contextmanager
def _signed(store: Store) -> Iterator[None]:
    owner = _owner(store)
    if owner and abs(time.time() - owner["alive"]) < _STALE:  # a clock may have been wrong
        raise _busy(store, owner)
    ended, mine = threading.Event(), secrets.token_hex(8)

    def sign() -> None:
        while not ended.wait(_BEAT):
            with suppress(DatabaseError):  # the next beat may come through, and parts report lasting trouble
                store.put(OWNER, _signature(mine))

    store.put(OWNER, _signature(mine))
    signed = _owner(store)
    if signed is None or signed["token"] != mine:
        raise _busy(store, signed)
    beat = threading.Thread(target=sign, daemon=True)
    beat.start()
    try:
        yield
    finally:
        ended.set()
        beat.join()
        store.delete(OWNER)


def _signature(token: str = "") -> bytes:
    return json.dumps(
        {"process": os.getpid(), "host": socket.gethostname(), "alive": time.time(), "token": token}
    ).encode()


def _owner(store: Store) -> Owner | None:
    """Return the owner of a place; None where nobody has signed."""
    try:
        owner = json.loads(store.get(OWNER)) if store.size(OWNER) else None
    except (DatabaseError, ValueError):
        return None
    if not isinstance(owner, dict) or not owner.keys() >= Owner.__annotations__.keys():
        return None
    return cast(Owner, owner) if type(owner["alive"]) in (int, float) else None


def _busy(store: Store, owner: Owner | None) -> DatabaseError:
    name = f"process {owner['process']} on {owner['host']}" if owner else "another process"
    wait = (
        ""
        if store.folder is not None
        else f"; if it was killed, its last sign of life counts for {_STALE:g} s, then run the same command again"
    )
    return DatabaseError(f"{store}: a sweep is already running on it ({name}); wait until it ends, or stop it{wait}")
