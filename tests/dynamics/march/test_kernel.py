"""Unit: the compiled kernel gives the same bits always, leaves other threads alone, and compiles once for a machine."""

import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from sigdb.core.errors import SigdbError
from sigdb.dynamics import Transient, march, prepare_periodic, settle
from sigdb.dynamics.march.kernel import march_steps
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


def many_modes(modes, steps):
    """Arguments of the kernel for as many modes that rest."""
    one, many = np.zeros((1, 1)), np.zeros((1, 2, modes))
    x, force, table = np.zeros((2, modes)), np.zeros(1), np.ones((1, 2, 2))
    free, none = np.zeros((0, 2, 2)), np.zeros((steps, 0))
    unit, decay, result = np.ones(1), np.zeros((2, modes)), np.zeros((steps, 1))
    return (
        x, force, decay, many, many, one, unit, unit, unit, np.zeros(steps), unit, table, free, none, none, result,
        result.copy(),
    )  # fmt: skip


def test_other_threads_go_on_while_it_marches():
    """The longest pause between two counts of this thread is far below the time of one call of the kernel."""
    march_steps(*many_modes(1, 1))
    took = []

    def run():
        arguments = many_modes(2000, 200_000)
        begin = time.perf_counter()
        march_steps(*arguments)
        took.append(time.perf_counter() - begin)

    thread = threading.Thread(target=run)
    thread.start()
    last, pause = time.perf_counter(), 0.0
    while thread.is_alive():
        now = time.perf_counter()
        last, pause = now, max(pause, now - last)
    thread.join()
    assert took[0] > 0.1
    assert pause < took[0] / 2


def test_what_is_not_a_number_goes_through_and_ends(rig):
    prepared = prepare_periodic(rig)
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


LOGGED = """
import logging
logging.basicConfig(level=logging.WARNING)
logging.getLogger("sigdb").setLevel(logging.INFO)
"""
COMPILES = """
import numpy as np
from sigdb.dynamics.march.kernel import march_steps
one, x = np.zeros((1, 1)), np.zeros((2, 1))
march_steps(
    x, np.zeros(1), x, np.zeros((1, 2, 1)), np.zeros((1, 2, 1)), one, np.ones(1), np.ones(1), np.ones(1),
    np.zeros(3), np.ones(1), np.ones((1, 2, 2)), np.zeros((0, 2, 2)), np.zeros((3, 0)), np.zeros((3, 0)),
    np.zeros((3, 1)), np.zeros((3, 1)),
)
"""


def test_it_compiles_once_for_a_machine():
    """Another process finds the machine code that this one has left or found."""
    march_steps(*many_modes(1, 3))
    assert list(Path(march_steps.stats.cache_path).glob("kernel.march_steps-*.nbi"))
    line = [sys.executable, "-W", "error", "-c", LOGGED + COMPILES]
    done = subprocess.run(line, capture_output=True, text=True, check=True, timeout=120)
    assert (done.stdout, done.stderr) == ("", "")
