"""Unit: the compiled kernel gives the same bits always, leaves other threads alone, and compiles once for a machine."""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sigdb.core.errors import SigdbError
from sigdb.dynamics import Transient, march, prepare, settle
from sigdb.transmission import Damage, load_transmission

BROKEN = Damage(tooth=3, stiffness_loss=0.6, phase_shift_deg=3.0)


@pytest.fixture(scope="module")
def rig():
    return load_transmission("nasa-spiral-bevel").replace({"operating.torque": 100.0})


def bits(history):
    return [one.tobytes() for one in (*history.signals.values(), *history.mesh_force.values(), history.state)]


def test_results_are_the_same_from_run_to_run_and_between_threads(rig):
    def run(_):
        return bits(march(rig, BROKEN, duration=0.05, sampling_rate=40e3))

    once = run(0)
    with ThreadPoolExecutor(2) as pool:
        assert all(again == once for again in pool.map(run, range(4)))


def test_other_threads_go_on_while_it_marches(oscillator):
    """Two seconds' worth of steps in one call of the kernel; a thread that takes the lock counts meanwhile."""
    oscillator(np.ones(2), 0.01)(1.0, 0.0, 10)
    begun, done, counts = threading.Event(), threading.Event(), []

    def count():
        begun.set()
        counted = 0
        while not done.is_set():
            counted += 1
            counts.append(counted)

    march, steps = oscillator(np.ones(2), 0.01), 4_000_000
    turns, forces = np.zeros(steps + 1), np.zeros(steps + 1)
    marked = []

    def run():
        march(1.0, 0.0, steps, turns=turns, forces=forces)
        marked.append(len(counts))

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e3)
    # Nobody is made to give the lock away: only who releases it lets another go on.
    try:
        counting = threading.Thread(target=count)
        run_thread = threading.Thread(target=run)
        run_thread.start()
        counting.start()
        run_thread.join()
    finally:
        done.set()
        sys.setswitchinterval(interval)
    counting.join()
    assert begun.is_set()
    assert marked[0] > 1000


def test_what_is_not_a_number_goes_through_and_ends(rig):
    prepared = prepare(rig)
    state = np.full((prepared.system.poles.imag >= 0).sum(), np.nan, complex)
    found = march(rig, duration=0.002, sampling_rate=20e3, state=state, system=prepared.system)
    assert np.isnan(found.signals["pinion-vertical"]).all()
    with pytest.raises(SigdbError, match="does not repeat"):
        settle(
            rig,
            gear="pinion",
            damage={},
            index_errors=np.zeros(12),
            state=state,
            solver=Transient(),
            system=prepared.system,
        )


COMPILES = """
import numpy as np
from sigdb.dynamics._march_steps import march_steps
one, x = np.zeros((1, 1)), np.zeros((2, 1))
march_steps(
    x, np.zeros(1), x, np.zeros((1, 2, 1)), np.zeros((1, 2, 1)), one, np.ones(1), np.ones(1), np.ones(1),
    np.zeros(3), np.ones(1), np.ones((1, 2, 2)), np.zeros((0, 2, 2)), np.zeros((3, 0)), np.zeros((3, 0)),
    np.zeros((3, 1)), np.zeros((3, 1)),
)
"""


def test_it_compiles_once_for_a_machine_and_says_so(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    line = [sys.executable, "-W", "error", "-c", COMPILES]
    told = [
        subprocess.run(line, capture_output=True, text=True, check=True, timeout=120, env=environment) for _ in range(2)
    ]
    assert [one.stdout for one in told] == ["", ""]
    assert told[0].stderr == ("sigdb: compiling march_steps for this machine; done once, it takes some seconds\n")
    assert told[1].stderr == ""
    assert list(tmp_path.rglob("*.nbi"))
