"""Forty processes at the same time, each of which leaves rows of a database unread and ends as a script does.

Files are read slowly, as from an object store, so that a thread that reads ahead would still read while Python ends.
The processes are forked before anything is read, and so import nothing again.

    python left_unread.py DIRECTORY
"""

import gc
import os
import signal
import sys
import time

from sigdb.database import open as open_database
from sigdb.database.store.store import Store

SECONDS = 300


def limit(database):
    """The rest of a table stays unread."""
    assert database.arrow("select id, fm4 from features limit 1").num_rows == 1


def stream(database):
    """The stream is still open."""
    database.kept = database.stream("select id, tsa from signals", rows=16)
    database.kept.read_next_batch()


def batches(database):
    """So are rows by a condition."""
    database.kept = database.batches("id > 4", table="signals", rows=16)
    database.kept.read_next_batch()


def scan(database):
    """So is a scan."""
    database.kept = database.scan("signals", ["tsa"])
    next(database.kept)


def slowly(*place, read=Store.get_range):
    """Read as from afar."""
    time.sleep(0.02)
    return read(*place)


Store.get_range = slowly
gc.freeze()  # what is imported is shared by all, and not looked through by each at its end
children = []
for number in range(40):
    child = os.fork()
    if not child:
        signal.alarm(SECONDS)  # which ends a process that hangs
        leave = (limit, limit, stream, batches, scan)[number % 5]
        leave(database := open_database(sys.argv[1]))
        sys.exit()
    children.append(child)
sys.exit(f"{codes}" if any(codes := [os.waitstatus_to_exitcode(os.waitpid(one, 0)[1]) for one in children]) else 0)
