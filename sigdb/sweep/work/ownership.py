"""Ownership of a database: one sweep at a time, or several jobs that share the work of one."""

import json
import os
import secrets
import shutil
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TypedDict, cast

from filelock import FileLock, Timeout

from sigdb.core import DatabaseError, make_folder
from sigdb.database import Store

OWNER, LOCK, JOBS = ".owner", ".lock", ".jobs"
"""Files of the owner and of the lock, and the folder of the jobs that own a place together."""
_PASSING = 5.0
"""Seconds that a job waits for another one that begins at the same instant."""
_BEAT, _STALE = 20.0, 90.0
"""Seconds between signs of life in an object store, and without one until an owner counts as dead."""


class Owner(TypedDict):
    """Content of the file of an owner: its process, its host, the time of its last sign of life, and a token."""

    process: int
    host: str
    alive: float
    token: str


@contextmanager
def ownership_of(store: Store, job: str = "") -> Iterator[None]:
    """Own a database's place while a sweep runs on it.

    The operating system locks a directory and releases the lock when its owner dies. An object store has no locks: its
    owner leaves a sign of life, which grows old when the owner has died. If two sweeps begin there at the same instant,
    both write the same bytes.

    Parameters
    ----------
    store
        The place.
    job
        Name of a job, without a slash. Jobs own the place together, and nobody else does.

    Raises
    ------
    DatabaseError
        If another sweep is running on it, or it cannot be written.
    """
    with _locked(store, store.folder, job) if store.folder is not None else _signed(store, job):
        yield


@contextmanager
def _locked(store: Store, folder: Path, job: str) -> Iterator[None]:
    mine = f"{JOBS}/{job}" if job else OWNER
    with ExitStack() as locks:
        try:
            make_folder(folder)
            if job:
                # A job passes through the lock of the place, so that it does not begin while somebody else owns it.
                make_folder(folder / JOBS)
                with FileLock(folder / LOCK, timeout=_PASSING):
                    locks.enter_context(FileLock(folder / f"{mine}{LOCK}", timeout=0))
            else:
                locks.enter_context(FileLock(folder / LOCK, timeout=0))
                for other in (folder / JOBS).glob(f"*{LOCK}"):
                    with FileLock(other, timeout=0):
                        pass
                shutil.rmtree(folder / JOBS, ignore_errors=True)  # of jobs that have ended
        except Timeout:
            raise _busy(store, next(iter(_owners(store, "")), None)) from None
        except OSError as error:
            raise DatabaseError(
                f"{store}: cannot be written ({error.strerror or error}); nothing that is finished is lost"
            ) from None
        try:
            store.put(mine, _signature())
            yield
        finally:
            (folder / mine).unlink(missing_ok=True)


@contextmanager
def _signed(store: Store, job: str) -> Iterator[None]:
    name = f"{JOBS}/{job}" if job else OWNER
    if owner := next(iter(_owners(store, job)), None):
        raise _busy(store, owner)
    ended, mine = threading.Event(), secrets.token_hex(8)

    def sign() -> None:
        while not ended.wait(_BEAT):
            with suppress(DatabaseError):  # the next beat may come through, and parts report lasting trouble
                store.put(name, _signature(mine))

    store.put(name, _signature(mine))
    signed = _owner(store, name)
    if signed is None or signed["token"] != mine:
        raise _busy(store, signed)
    beat = threading.Thread(target=sign, daemon=True)
    beat.start()
    try:
        yield
    finally:
        ended.set()
        beat.join()
        store.delete(name)


def _owners(store: Store, job: str) -> list[Owner]:
    """Return the owners of a place that live, but for those who own it together with a job."""
    names = [OWNER, *([f"{JOBS}/{job}"] if job else store.sizes(JOBS))]
    owners = [owner for name in names if (owner := _owner(store, name))]
    # A clock may have been wrong.
    return [owner for owner in owners if store.folder is not None or abs(time.time() - owner["alive"]) < _STALE]


def _signature(token: str = "") -> bytes:
    return json.dumps(
        {"process": os.getpid(), "host": socket.gethostname(), "alive": time.time(), "token": token}
    ).encode()


def _owner(store: Store, name: str = OWNER) -> Owner | None:
    """Return the owner who has signed a file of a place; None where nobody has."""
    try:
        owner = json.loads(store.get(name)) if store.size(name) else None
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
