"""Processor time of commands alone, and beside busy processes that take the machine's cores.

A program whose threads wait for each other spends processor time on the waiting as soon as others run. Each command
runs in a process of its own, --repeats times alone and as often beside --busy processes, in turn. The ratio is that of
the least processor times, children included. A core whose other thread is busy is itself slower: the row ``one thread``
shows by how much, with a loop in plain Python.

    python benchmarks/shared_machine.py [--busy N] [--repeats N] [--only NAME ...] [--json FILE]
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from measuring import environment, json_option, publish

import sigdb
from sigdb.recording import synthetic_recording

AIM = 1.3
QUICK = Path(__file__).parents[1] / "pipelines" / "quick.toml"
SIGDB = (sys.executable, "-m", "sigdb")
LOOP = "x = 0\nfor k in range(60_000_000): x += k * k"
SIMULATE = """
import sigdb
rig = sigdb.load_transmission("nasa-spiral-bevel")
for tooth in range(1, 13):
    sigdb.simulate(rig, sigdb.Damage(tooth=tooth, stiffness_loss=0.25))
"""
READING = ("--sampling-rate", "102400", "--tacho", "tacho", "--rig", "nasa-spiral-bevel", "--healthy", "new.csv")
COMMANDS = {
    "one thread": (sys.executable, "-c", LOOP),
    "simulate": (sys.executable, "-c", SIMULATE),
    "describe": (*SIGDB, "describe", "nasa-spiral-bevel"),
    "dry run": (*SIGDB, "sweep", str(QUICK), "--dry-run"),
    "diagnose": (*SIGDB, "diagnose", "run.csv", *READING),
    "quick recipe": (*SIGDB, "run", str(QUICK), "--out", "quick"),
}


def main() -> None:
    """Print the table, or a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--busy", type=int, default=8, help="busy processes beside a command")
    parser.add_argument("--repeats", type=int, default=2, help="runs of each command, alone and beside others")
    parser.add_argument("--only", nargs="*", choices=list(COMMANDS), default=list(COMMANDS), help="these commands")
    json_option(parser)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        write_recordings(Path(folder))
        rows = [row(name, Path(folder), options.busy, options.repeats) for name in options.only]
    machine = environment("numpy", "scipy", "scikit-learn", "numba")
    publish(machine, {f"alone, and beside {options.busy} busy processes": rows}, options.json)


def write_recordings(folder: Path) -> None:
    """Write ``new.csv`` and ``run.csv``, a healthy gear and one with a damaged tooth."""
    rig = sigdb.load_transmission("nasa-spiral-bevel")
    for seed, (name, damage) in enumerate({"new": None, "run": sigdb.Damage(tooth=6, stiffness_loss=0.4)}.items()):
        recording = synthetic_recording(rig, damage, sampling_rate=102.4e3, revolutions=102, seed=seed)
        columns = np.column_stack([channel.samples for channel in recording.channels])
        np.savetxt(folder / f"{name}.csv", columns, delimiter=",", header="a1,tacho", comments="", fmt="%.6g")


def row(name: str, folder: Path, busy: int, repeats: int) -> dict[str, Any]:
    """Processor seconds of a command alone and beside others, their ratio, and how long it took."""
    found: dict[str, list[tuple[float, float]]] = {"alone": [], "busy": []}
    for _ in range(repeats):
        found["alone"].append(cost(COMMANDS[name], folder))
        with busy_processes(busy):
            found["busy"].append(cost(COMMANDS[name], folder))
    (alone, alone_wall), (beside, beside_wall) = (min(found[where]) for where in ("alone", "busy"))
    return {
        "command": name,
        "alone, s": alone,
        "beside others, s": beside,
        "ratio": beside / alone,
        "took alone, s": alone_wall,
        "took beside others, s": beside_wall,
    }


def cost(command: tuple[str, ...], folder: Path) -> tuple[float, float]:
    """Processor time of a process and its children, and the time that passed, s."""
    for made in ("quick", "cache"):
        shutil.rmtree(folder / made, ignore_errors=True)
    before, started = children_seconds(), time.perf_counter()
    done = subprocess.run(
        command,
        cwd=folder,
        env=os.environ | {"SIGDB_CACHE": str(folder / "cache")},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    )
    if done.returncode not in (0, 1):  # 1 is a damaged gear
        raise SystemExit(f"{' '.join(command)} ended with {done.returncode}")
    return children_seconds() - before, time.perf_counter() - started


def children_seconds() -> float:
    """Processor time of all children that have ended, s."""
    times = os.times()
    return times.children_user + times.children_system


@contextmanager
def busy_processes(count: int) -> Iterator[None]:
    """Keep processes busy for a while. Their processor time is counted when they end, after what is measured."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


if __name__ == "__main__":
    main()
