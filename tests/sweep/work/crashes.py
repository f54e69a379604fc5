"""A sweep that is killed at random instants until it is done, while a reader looks: a command.

python tests/sweep/work/crashes.py --kills 200 --seed 1
"""

import argparse
import contextlib
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pandas as pd

import sigdb
from sigdb.core.errors import InputError
from sigdb.pipeline import load_recipe
from sigdb.sweep import run, verify

LOSSES = [round(0.01 * k, 2) for k in range(1, 41)]
RECIPE = f"""
[sweep]
rig = "nasa-spiral-bevel"
seed = 7
specimens = 6

[[sweep.grid]]
pinion.teeth = 11
tooth = "all"
damaged_teeth = [1, 2]
stiffness_loss = {LOSSES}
averages = 36

[signature]
samples_per_tooth = 32
sensors = ["pinion-vertical"]
"""
# 81 templates in two parts, 5280 rows in three.

Process = subprocess.Popen[bytes]
VICTIMS = ("worker", "parent", "group")


class Reader(threading.Thread):
    """Opens a database again and again, and compares all that it sees with the undisturbed one."""

    def __init__(self, undisturbed: Path, seed: int) -> None:
        super().__init__(daemon=True)
        self.folder: Path | None = None
        self.error: BaseException | None = None
        self.reads: Counter[int] = Counter()
        self._ended, self._looking = threading.Event(), threading.Lock()
        self._rng = np.random.default_rng(seed)
        whole = sigdb.open(undisturbed)
        self._cases, self._templates = whole.cases(), whole.templates()
        self._signals = whole.signals(self._cases["id"])

    def run(self) -> None:
        while not self._ended.wait(0.2):
            try:
                with self._looking:
                    if self.folder is not None:
                        self.look(self.folder)
            except BaseException as error:
                self.error = error
                return

    def look_at(self, folder: Path | None) -> None:
        """Look at another database from now on, or at none."""
        with self._looking:
            self.folder = folder

    def end(self) -> None:
        self._ended.set()
        self.join()
        if self.error is not None:
            raise self.error

    def look(self, folder: Path) -> None:
        """All rows and templates that are there, and some signals; only a database that is not begun may be missing."""
        try:
            database = sigdb.open(folder)
        except InputError:
            assert not (folder / "sigdb.toml").exists() or not self.reads
            return
        self.reads[len(database)] += 1
        if not len(database):
            return
        cases = database.cases()
        assert len(cases) == len(database)
        parts = sorted(set(cases["id"] // database.manifest.part_rows))
        size = database.manifest.part_rows
        ids = np.concatenate([np.arange(size * part, min(size * (part + 1), len(self._cases))) for part in parts])
        assert np.array_equal(cases["id"], ids)
        pd.testing.assert_frame_equal(cases, self._cases.iloc[ids].reset_index(drop=True))
        some = self._rng.choice(ids, 5)
        for name, values in database.signals(some).items():
            assert np.array_equal(values, self._signals[name][some])
        templates = database.templates()
        pd.testing.assert_frame_equal(templates, self._templates.iloc[templates["template"]].reset_index(drop=True))


class Sweeps:
    """The command, started in sessions of their own, all of which end with this."""

    def __init__(self, recipe: Path) -> None:
        self.recipe, self.log = recipe, recipe.with_name("log.txt")
        self._sessions: list[Process] = []

    def start(self, folder: Path, jobs: int = 2) -> Process:
        command = [sys.executable, "-m", "sigdb.sweep", str(self.recipe), "--out", str(folder), "--jobs", str(jobs)]
        with self.log.open("w") as log:  # a pipe would stay open as long as workers outlive their parent
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=log, start_new_session=True)
        self._sessions.append(process)
        return process

    def end(self) -> None:
        """Kill whatever is left of them: workers outlive a killed parent for a while."""
        for process in self._sessions:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        self._sessions.clear()


def workers_of(process: Process) -> list[int]:
    """Process numbers of its worker processes."""
    listed = subprocess.run(["ps", "-A", "-o", "pid=,ppid=,args="], capture_output=True, text=True, check=True)
    rows = [line.split(maxsplit=2) for line in listed.stdout.splitlines()]
    return [int(row[0]) for row in rows if int(row[1]) == process.pid and "popen_loky" in row[2]]


def kill(process: Process, victim: str, rng: np.random.Generator) -> str:
    """Kill one of its workers, itself alone, or all; a parent without workers dies instead. Says who died."""
    if victim == "worker":
        workers = workers_of(process)
        if workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(rng.choice(workers)), signal.SIGKILL)
            return victim
        victim = "parent"
    if victim == "group":
        os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    return victim


def wait_for_instant(process: Process, folder: Path, delay: float, aimed: bool) -> bool:
    """Wait for a while, and then for a file that is being written if it is aimed at one; False if it ended before."""
    deadline = time.monotonic() + delay
    while time.monotonic() < deadline:
        if process.poll() is not None:
            return False
        time.sleep(0.005)
    while aimed and not any(folder.rglob("*.tmp")):
        if process.poll() is not None:
            return False
        time.sleep(0.0005)
    return process.poll() is None


def digests(folder: Path) -> dict[str, str]:
    """SHA-256 of what must not depend on kills: all but receipts, which tell hosts and seconds, and the lock."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.parent.name != "receipts" and path.name != ".lock"
    }


def check(process: Process, log: Path) -> None:
    """A sweep that was not killed itself is done, or gives up since its workers kept dying."""
    process.wait(timeout=300)
    said = log.read_text(encoding="utf-8")
    gave_up = process.returncode == 3 and "worker processes keep dying" in said and "Traceback" not in said
    assert process.returncode in (0, -signal.SIGKILL) or gave_up, (process.returncode, said)


def crash(folder: Path, *, kills: int, seed: int) -> str:
    """Kill sweeps ``kills`` times in all and go on until each is done; what was done, in a sentence.

    Raises
    ------
    AssertionError
        If a database is another than that of the undisturbed sweep, or the reader has seen something that is not.
    """
    rng = np.random.default_rng(seed)
    (folder / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    recipe, sweeps = load_recipe(folder / "recipe.toml"), Sweeps(folder / "recipe.toml")
    started = time.monotonic()
    first = sweeps.start(folder / "undisturbed", jobs=1)
    check(first, sweeps.log)
    duration = time.monotonic() - started
    expected = digests(folder / "undisturbed")
    assert first.returncode == 0
    assert len(expected) == 2 + 2 + 3 + 3

    reader = Reader(folder / "undisturbed", seed)
    reader.start()
    died: Counter[str] = Counter()
    rounds = 0
    try:
        while died.total() < kills:
            here, rounds, done = folder / f"round-{rounds}", rounds + 1, False
            reader.look_at(here)
            while not done:
                process = sweeps.start(here)
                while died.total() < kills and wait_for_instant(
                    process, here, rng.uniform(0, duration), aimed=rng.random() < 0.4
                ):
                    victim = kill(process, VICTIMS[died.total() % len(VICTIMS)], rng)
                    died[victim] += 1
                    if victim != "worker":
                        break
                check(process, sweeps.log)
                done = process.returncode == 0
            sweeps.end()
            assert run(recipe.plan(), here, recipe=recipe.text, jobs=1).new_rows == 0
            assert digests(here) == expected
            assert not list(here.rglob("*.tmp"))
            assert verify(here) == ()
            reader.look_at(None)
            reader.look(here)
            shutil.rmtree(here)
    finally:
        sweeps.end()
        reader.end()
    who = ", ".join(f"{count} of a {victim}" for victim, count in sorted(died.items()))
    seen = f"{reader.reads.total()} looks at {len(reader.reads)} stages"
    return f"{died.total()} kills ({who}) of {rounds} databases, {seen}, {time.monotonic() - started:.0f} s: all whole"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Kill a sweep at random instants until it is done, again and again.")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        print(crash(Path(place), kills=arguments.kills, seed=arguments.seed))
