"""Unit: a query ends at its limits of time, memory and rows, or when it is interrupted; threads share a database."""

import math
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import sigdb
from sigdb.core import InputError
from sigdb.database.limits import QueryLimits, TimedCalls

ENDLESS = "select count(*) from range(1000000000000) a, range(1000000) b"
ALSO_ENDLESS = "with recursive f(x) as (select 1 union all select x + 1 from f) select count(*) from f"


@pytest.mark.parametrize(
    ("query", "limits", "says"),
    [
        (ENDLESS, {"max_seconds": 0.2}, r"was stopped after 0\.2 s.* max_seconds \(--max-seconds\)"),
        (ALSO_ENDLESS, {"max_seconds": 0.2}, r"was stopped after 0\.2 s"),
        (
            "select list(i) from range(300000000) t(i)",
            {"max_memory_gb": 0.1},
            r"needs more memory than 0\.1 GB.*--max-memory",
        ),
        (
            "select * from range(300000000) t(i) order by hash(i)",
            {"max_memory_gb": 0.1},
            r"needs more memory than 0\.1 GB",
        ),
        ("select i, i::varchar from range(9000000) t(i)", {"max_memory_gb": 0.05}, r"needs more memory than 0\.05 GB"),
        (
            "select * from range(100000000000)",
            {"max_rows": 20000},
            r"has more rows than 20000.* max_rows \(--max-rows\)",
        ),
    ],
)
def test_a_query_ends_at_its_limit(database, query, limits, says):
    for run in (database.sql, lambda text, **some: database.stream(text, **some).read_all()):
        if "max_memory_gb" in limits and "varchar" in query and run != database.sql:
            continue  # a stream holds no result
        with pytest.raises(InputError, match=rf"^query: {says}") as error:
            run(query, **limits)
        assert "\n" not in str(error.value)
    assert len(database.sql("select 1", **limits)) == 1


@pytest.mark.parametrize("where", [f"({ENDLESS}) > 0", "id in (select x from range(1000000000000) t(x))"])
def test_a_condition_ends_at_its_limit(database, where, tmp_path):
    tsa = database.signals([0])["tsa"][0]
    for read in (
        lambda: database.cases(where, max_seconds=0.2),
        lambda: database.features(where, max_seconds=0.2),
        lambda: database.batches(where, max_seconds=0.2).read_all(),
        lambda: database.match(tsa, where=where.replace("id in", "template in"), max_seconds=0.2),
        lambda: database.export(tmp_path / "rows.mat", where=where, max_seconds=0.2),
        lambda: database.export(tmp_path / "rows.h5", where=where, max_seconds=0.2),
    ):
        with pytest.raises(InputError, match=r"was stopped after 0\.2 s"):
            read()
    assert list(tmp_path.iterdir()) == []


def test_time_between_batches_does_not_count(database):
    stream = database.stream("select range from range(100)", rows=10, max_seconds=0.3)
    rows = 0
    for batch in stream:
        rows += batch.num_rows
        time.sleep(0.1)
    assert rows == 100


def test_the_right_number_of_rows_is_within_the_limit(database):
    assert len(database.sql("select * from range(1000)", max_rows=1000)) == 1000


@pytest.mark.parametrize(
    "limits",
    [
        {"max_seconds": 0},
        {"max_seconds": math.nan},
        {"max_memory_gb": -1},
        {"max_memory_gb": math.inf},
        {"max_rows": 0},
    ],
)
def test_a_limit_is_a_number_above_0(database, limits):
    with pytest.raises(InputError, match=next(iter(limits))):
        database.sql("select 1", **limits)


def test_ctrl_c_ends_a_query():
    """The call is interrupted, and its error is the interruption."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # who runs the tests may have it ignored
    ended = threading.Event()
    calls = TimedCalls(60, ended.set)
    timer = threading.Timer(0.1, lambda: signal.raise_signal(signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            calls.run(ended.wait)
    finally:
        calls.close()
        timer.join()
        signal.signal(signal.SIGINT, before)
    assert ended.is_set()
    assert not calls.out_of_time


def test_limits_say_what_to_raise():
    error = QueryLimits(max_rows=7).exceeded("max_rows")
    assert str(error) == "query: has more rows than 7, which is its limit; ask for less, or raise max_rows (--max-rows)"


def test_eight_threads_share_a_database(folder):
    database = sigdb.open(folder)
    tsa = database.signals([40])["tsa"][0]
    rows = len(database)
    sixes = (database.cases()["tooth"] == 6).sum()

    def work(k):
        return (
            int(database.sql("select count(*) as n from features")["n"].iloc[0]),
            len(database.cases("tooth = 6")),
            len(database.match(tsa, k=2, where="template >= 0").table),
            database.stream(f"select id from signals where id < {k + 5}").read_all().num_rows,
        )

    with ThreadPoolExecutor(8) as threads:
        for k, result in enumerate(threads.map(work, range(24))):
            assert result == (rows, sixes, 2, k + 5)


def test_an_error_is_that_of_its_own_thread(folder):
    database = sigdb.open(folder)

    def work(k):
        try:
            database.sql(f"select column_{k} from cases")
        except InputError as error:
            return f"column_{k}" in str(error)

    with ThreadPoolExecutor(8) as threads:
        assert all(threads.map(work, range(16)))
