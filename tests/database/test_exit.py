"""Unit: a process that leaves rows of a database unread ends, and with 0; a closed database ends its queries."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import sigdb
from sigdb.core import SigdbError

SCRIPT = Path(__file__).with_name("left_unread.py")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked from one that has imported the library")
def test_forty_processes_that_leave_rows_unread_end_with_0(parts_folder):
    done = subprocess.run([sys.executable, SCRIPT, parts_folder], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_closed_database_ends_streams_and_takes_no_query(folder):
    with sigdb.open(folder) as database:
        stream = database.stream("select id, tsa from signals", rows=16)
        assert stream.read_next_batch().num_rows == 16
        assert len(database.sql("select 1")) == 1
    with pytest.raises(SigdbError):
        stream.read_all()
    with pytest.raises(SigdbError, match=r"this database was closed; open it again with sigdb\.open"):
        database.sql("select 1")
    database.close()


def test_a_stream_outlives_its_database(folder):
    stream = sigdb.open(folder).stream("select id from features", rows=64)
    assert stream.read_all().num_rows == len(sigdb.open(folder))
