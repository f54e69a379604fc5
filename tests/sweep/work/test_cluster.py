"""Unit: a Dask cluster makes the same bytes as processes of this machine, and outlives a worker."""

import os
import signal
import threading
import time

import distributed
import pytest

from sigdb.core.errors import DatabaseError, InputError
from sigdb.sweep import run


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        yield cluster


def test_the_same_bytes_and_a_killed_worker_s_part_is_made_again(
    cluster, parts_plan, parts_text, parts_folder, tmp_path, digests
):
    folder, killed, seen = tmp_path / "db", [], []

    def kill():
        while not list(folder.glob("receipts/templates-*.json")):
            time.sleep(0.005)
        worker = next(iter(cluster.workers.values()))
        worker.close_gracefully()  # no other takes its place
        os.kill(worker.pid, signal.SIGKILL)
        killed.append(worker)

    killer = threading.Thread(target=kill)
    killer.start()
    summary = run(parts_plan, folder, recipe=parts_text, scheduler=cluster.scheduler_address, on_progress=seen.append)
    killer.join()
    assert killed
    assert [one.done for one in seen if one.stage == "rows"][-1] == parts_plan.rows
    assert summary.new_rows == parts_plan.rows
    assert digests(folder) == digests(parts_folder)


def test_an_address_where_nobody_answers(parts_plan, tmp_path):
    with pytest.raises(InputError, match=r"--scheduler tcp://127\.0\.0\.1:9: no Dask scheduler answers there"):
        run(parts_plan, tmp_path / "db", scheduler="tcp://127.0.0.1:9")
    with pytest.raises(InputError, match=r"--scheduler nonsense::: no Dask scheduler"):
        run(parts_plan, tmp_path / "db", scheduler="nonsense::")


def test_a_scheduler_without_workers(parts_plan, tmp_path):
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0") as idle,
        pytest.raises(DatabaseError, match=r"has no workers; start some: dask worker"),
    ):
        run(parts_plan, tmp_path / "db", scheduler=idle.scheduler_address)
