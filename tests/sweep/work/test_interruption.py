"""Unit: interrupted, or with a worker that dies, a sweep goes on to the same bytes; crashes.py kills it at random."""

import contextlib
import importlib
import os
import signal
import subprocess
import sys
import time

import pytest

from sigdb.core.errors import DatabaseError
from sigdb.database.store.store import Store
from sigdb.sweep import run
from sigdb.sweep.work.engines import Processes, WorkerDiedError

PARTS = 3
SWEEP_RUN = importlib.import_module("sigdb.sweep.work.run")


@pytest.fixture(scope="module")
def recipe(recipe_of, parts_text):
    """Rows of some seconds, in three parts."""
    return recipe_of(parts_text)


@pytest.fixture
def start(recipe, tmp_path):
    """Start the command in a session of its own, on ``tmp_path / "signatures"``."""
    started = []

    def sweep():
        command = [sys.executable, "-m", "sigdb.sweep", str(recipe.path), "--out", str(tmp_path / "signatures")]
        process = subprocess.Popen(
            [*command, "--jobs", "2"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            # Whoever runs the tests in the background may have Ctrl-C ignored, which is inherited.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        started.append(process)
        return process

    yield sweep
    for process in started:
        # The sessions that this test started: workers outlive a killed parent for a while.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def wait_for(process, condition):
    deadline = time.monotonic() + 60
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.002)


def receipts(folder, name="rows"):
    return len(list((folder / "receipts").glob(f"{name}-*.json")))


def test_interrupted_from_the_keyboard(recipe, start, tmp_path, parts_folder, digests):
    """Ctrl-C reaches the whole group: nothing half is there, and the sweep goes on to the same bytes."""
    folder = tmp_path / "signatures"
    process = start()
    wait_for(process, lambda: receipts(folder) >= 1)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "interrupted; what is finished is kept, and the same command goes on" in err
    assert "Traceback" not in err
    assert not (folder / ".owner").exists()
    assert 0 < receipts(folder) < PARTS
    run(recipe.plan(), folder, recipe=recipe.text, jobs=1)
    assert digests(folder) == digests(parts_folder)


def deadly(marker, maker):
    """A maker whose process is killed at part 1, unless there is a marker that it died before. Pickled by value."""

    def make(plan, store, part):
        import os as worker_os
        import signal as worker_signal

        if part == 1:
            try:
                worker_os.close(worker_os.open(marker, worker_os.O_CREAT | worker_os.O_EXCL))
                worker_os.kill(worker_os.getpid(), worker_signal.SIGKILL)
            except FileExistsError:
                pass
        return maker(plan, store, part)

    return make


def test_a_worker_that_dies_does_not_end_the_sweep(
    parts_plan, parts_text, parts_folder, tmp_path, monkeypatch, digests
):
    marker = tmp_path / "died"
    monkeypatch.setitem(SWEEP_RUN._MAKERS, "rows", deadly(str(marker), SWEEP_RUN._MAKERS["rows"]))
    summary = run(parts_plan, tmp_path / "signatures", recipe=parts_text, jobs=2)
    assert marker.exists()
    assert summary.new_rows == 5060
    assert digests(tmp_path / "signatures") == digests(parts_folder)


def test_workers_that_keep_dying_end_the_sweep_with_a_sentence(parts_plan, parts_text, tmp_path, monkeypatch):
    deaths = []

    def receipts(self, *arguments):
        deaths.append(self)
        raise WorkerDiedError

    monkeypatch.setattr(Processes, "receipts", receipts)
    with pytest.raises(DatabaseError, match=r"keep dying .* 0 of 5 templates are kept; run .* with fewer --jobs"):
        run(parts_plan, tmp_path / "signatures", recipe=parts_text, jobs=2)
    assert len(deaths) == 3


def test_two_writers_of_one_file_do_not_disturb_each_other(tmp_path, monkeypatch):
    """A worker that outlives its parent and the sweep that goes on may publish the same part at the same time."""
    replaced = os.replace

    def after_another_writer(temporary, path):
        other = "import sys; from sigdb.database.store.store import Store; Store.at(sys.argv[1]).put('file', b'same')"
        subprocess.run([sys.executable, "-c", other, str(tmp_path)], check=True)
        replaced(temporary, path)

    monkeypatch.setattr(os, "replace", after_another_writer)
    Store.at(tmp_path).put("file", b"same")
    assert (tmp_path / "file").read_bytes() == b"same"
    assert list(tmp_path.iterdir()) == [tmp_path / "file"]


def test_a_file_that_cannot_be_finished_leaves_nothing(tmp_path, monkeypatch):
    store = Store.at(tmp_path)
    store.put("file", b"old")

    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(DatabaseError, match=r"file: cannot be written \(No space left on device\); nothing"):
        store.put("file", b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    assert store.get("file") == b"old"
