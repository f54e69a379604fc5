"""How a monitor alarms on histories whose change is known, and what one more recording costs it at 10 000.

A gear of 12 teeth with errors is looked at 60 times, and the first 20 looks are labelled healthy. Then nothing changes;
an event at one tooth grows by a step each look; the load rises by a third, stated or not, or rises by a tenth or falls
by a quarter, not stated; the sensor is exchanged for one of twice the gain, also with an event that grows from then on;
or the gear is exchanged. Looks come daily, and 12 false alarms a year are allowed, so that they can be counted.

One more recording is ingested and monitored at 10 000 of one machine, and of 200 machines; the processor time counts
without imports. Such a database takes some minutes; ``--folder`` keeps it.

    python benchmarks/monitor.py [--histories 20] [--json benchmarks/monitor.json]
"""

import argparse
import json
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
from click.testing import CliRunner
from measuring import environment, print_table, timed

from sigdb.cli.main import cli
from sigdb.core import FloatArray
from sigdb.diagnosis import Power
from sigdb.monitoring import GearHistory, Look, MonitorSettings, gear_history
from sigdb.monitoring.look_results import Reference
from sigdb.recording import EnvelopeSpectrum, MeshPresence, RecordedSignature

TEETH, SAMPLES, GROUPS = 12, 32, 8
HEALTHY, CHANGED, LOOKS = 20, 30, 60
"""Looks that are labelled healthy, the first look of a change, and all looks."""
FALSE_ALARMS, A_YEAR, GROWTH = 12.0, 365.25, 0.02
PASSES = np.arange(TEETH * SAMPLES) / SAMPLES
MACHINES = (1, 200)
"""Machines, each with a history, among which the recordings of a large database are divided."""


@dataclass(frozen=True, kw_only=True)
class State:
    """State of the machine at a look: event at a tooth, gear, gain of the sensor, load."""

    event: float = 0.0
    gear: int = 0
    gain: float = 1.0
    load: float = 1.0


KINDS = {
    "nothing": lambda step: State(),
    "growing damage": lambda step: State(event=GROWTH * step),
    "load, stated": lambda step: State(load=1 + (step > 0) / 3),
    "load, not stated": lambda step: State(load=1 + (step > 0) / 3),
    "a tenth more load, not stated": lambda step: State(load=1 + (step > 0) / 10),
    "a quarter less load, not stated": lambda step: State(load=1 - (step > 0) / 4),
    "sensor exchanged": lambda step: State(gain=1.0 + (step > 0)),
    "sensor exchanged, growing damage": lambda step: State(gain=1.0 + (step > 0), event=GROWTH * step),
    "gear exchanged": lambda step: State(gear=int(step > 0)),
}


def main() -> None:
    """Print the tables, or write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--histories", type=int, default=20, help="histories of each kind; 20 by default")
    parser.add_argument("--recordings", type=int, default=10_000, help="recordings of a large database")
    parser.add_argument("--folder", type=Path, help="folder for the large databases, which are kept; else a temporary")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    rows = [counted(kind, options.histories) for kind in KINDS]
    print_table("Histories", rows)
    with tempfile.TemporaryDirectory() as temporary:
        place = options.folder or Path(temporary)
        os.environ["SIGDB_CACHE"] = str(place / "cache")
        more = [one_more_recording(place, options.recordings, machines) for machines in MACHINES]
    print_table("One more recording", more)
    if options.json is not None:
        tables = {"histories": rows, "one more recording": more}
        document = {"machine": environment("numpy", "scipy"), "tables": tables}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def counted(kind: str, histories: int) -> dict[str, Any]:
    """Alarms before and after the change, delays and answers of histories of a kind."""
    before, after, doubts, delays, answers = 0, 0, 0, [], []
    for seed in range(histories):
        found = history(kind, seed)
        alarms = found.looks["alarm"].to_numpy()
        before += int(alarms[HEALTHY:CHANGED].sum())
        late = alarms[CHANGED:]
        after += int(late.sum())
        doubts += int((found.looks["doubt"] != "")[CHANGED:].sum())
        delays.append(int(late.argmax()) if late.any() else None)
        answers.append(found.answer.kind)
    seen = [delay for delay in delays if delay is not None]
    common = pd.Series(answers).value_counts()
    return {
        "change": kind,
        "histories": histories,
        "alarms_before": before,
        "looks_before": histories * (CHANGED - HEALTHY),
        "expected": histories * (CHANGED - HEALTHY) * FALSE_ALARMS / A_YEAR,
        "alarms_after": after,
        "looks_after": histories * (LOOKS - CHANGED),
        "doubts_after": doubts,
        "histories_with_an_alarm": len(seen),
        "median_delay": float(np.median(seen)) if seen else None,
        "answers_at_the_end": ", ".join(f"{name}: {count}" for name, count in common.items()),
    }


def history(kind: str, seed: int) -> GearHistory:
    """Return the history of a kind."""
    looks = []
    for number in range(LOOKS):
        state = KINDS[kind](max(0, number - CHANGED + 1))
        one = look(number, seed, state)
        looks.append(replace(one, torque=state.load) if kind == "load, stated" else one)
    with patch.object(Reference, "power", lambda *_: NO_POWER):
        return gear_history(looks, MonitorSettings(false_alarms_a_year=FALSE_ALARMS, looks_a_year=A_YEAR))


NO_POWER = Power(
    quantity="pulse", smallest=1.0, share_of_rms=1.0, exceptions=pd.DataFrame({"tooth": [], "smallest": []}),
    greatest=1.0, table=pd.DataFrame({"value": [], "seen": []}),
)  # fmt: skip
"""A power in place of the one that is computed for a reference: no alarm depends on it."""


def look(number: int, seed: int, state: State) -> Look:
    """Return a look at a day."""
    return Look(
        name=f"day {number}",
        key=f"day {number}",
        day=float(number),
        torque=None,
        load=None,
        health="healthy" if number < HEALTHY else "unknown",
        kept=0.9,
        read=lambda: signature(number, seed, state),
    )


def signature(number: int, seed: int, state: State) -> RecordedSignature:
    """Return the signature of a state: errors of the teeth that a load turns a little, an event, noise."""
    errors = 0.1 * np.random.default_rng([seed, state.gear]).standard_normal((2, TEETH))
    stream = np.random.default_rng([seed, 100, number])
    load = state.load * (1 + 0.01 * stream.standard_normal())
    each = 1 + errors[0] + (load - 1) * errors[1]
    mesh = sum(load**power * np.cos(2 * np.pi * h * PASSES + h) / h for h, power in ((1, 1.0), (2, 1.2), (3, 0.8)))
    after = (PASSES - 4.9 + TEETH / 2) % TEETH - TEETH / 2
    x = each[PASSES.astype(int)] * mesh + state.event * np.exp(-2 * after**2) * np.cos(3 * np.pi * after)
    groups = state.gain * (x + 0.1 * stream.standard_normal((GROUPS, len(x))))
    return _signature(groups)


def _signature(groups: FloatArray) -> RecordedSignature:
    empty, n = pd.DataFrame(), groups.shape[1]
    return RecordedSignature(
        source="made here", channel="a1", unit="m/s^2", gear="gear", shaft=None, teeth=TEETH, angle="tacho",
        absolute=True, tsa=groups.mean(axis=0), scatter=0.1, noise=np.full(n // 2 + 1, 0.03), groups=groups,
        averages=80, dropped=0, cycle=None, speed_rpm=1500.0, speed_track=empty, kept=0.9,
        presence=MeshPresence(present=True, reason="made here", p_value=0.0), highest_order=160.0,
        order_spectrum=empty, record_spectrum=empty, lines=empty, indicators={}, intervals=empty,
        envelope=EnvelopeSpectrum(band=(0.0, 0.0), chosen="none", kurtosis=0.0, spectrum=empty, lines=empty),
        shafts=empty, order_map=None, notes=(),
    )  # fmt: skip


FS, SHORT_TEETH, REVS_A_SECOND, SECONDS = 2048.0, 12, 20.0, 2.0


def write_recording(path: Path, seed: int) -> None:
    """Write a short recording of uneven teeth with a tacho."""
    t = np.arange(int(FS * SECONDS)) / FS
    turns = REVS_A_SECOND * t
    errors = 1 + 0.2 * np.random.default_rng(5).normal(size=SHORT_TEETH)
    mesh = np.cos(2 * np.pi * SHORT_TEETH * turns) + 0.4 * np.cos(4 * np.pi * SHORT_TEETH * turns + 1)
    x = mesh * errors[(turns * SHORT_TEETH).astype(int) % SHORT_TEETH]
    x += 0.1 * np.random.default_rng(seed).normal(size=t.size)
    np.savez(path, a1=x.astype(np.float32), tacho=(5.0 * (turns % 1 < 0.1)).astype(np.float32))


def add_recordings(folder: Path, numbers: range, machines: int) -> None:
    """Write recordings of some machines in turn, one a day each, with their lines of the table."""
    table, lines = folder / "recordings.csv", list[str]()
    for number in numbers:
        day = number // machines
        write_recording(folder / f"r{number:05d}.npz", number)
        date = np.datetime64("2000-01-01") + day
        lines.append(f"r{number:05d}.npz,m{number % machines},{date},{'normal' if day < HEALTHY else ''}\n")
    before = table.read_text(encoding="utf-8") if table.exists() else "file,machine,date,state\n"
    table.write_text(before + "".join(lines), encoding="utf-8")


def ingest_and_monitor(folder: Path) -> None:
    """Run both commands, in this process."""
    reading = ("--tacho", "tacho", "--sampling-rate", str(FS), "--samples-per-tooth", "16", "--jobs", "1")
    commands = (
        ["ingest", str(folder), "--out", str(folder / "db"), "--teeth", str(SHORT_TEETH), *reading],
        ["monitor", str(folder / "db")],
    )
    for command in commands:
        result = CliRunner().invoke(cli, command)
        if result.exit_code not in (0, 1, 3) or not isinstance(result.exception, SystemExit | None):
            raise RuntimeError(result.output) from result.exception


def one_more_recording(place: Path, count: int, machines: int) -> dict[str, Any]:
    """Return the processor time of one more recording after so many of some machines, with its ingest.

    A small folder comes first, so that nothing is imported or compiled while the time is taken. The median of three
    recordings counts. A folder that exists is gone on with.
    """
    warm, folder = place / "warm", place / f"{count}-of-{machines}"
    for each, size, owners in ((warm, HEALTHY + 2, 1), (folder, count, machines)):
        if not each.exists():
            each.mkdir(parents=True)
            add_recordings(each, range(size), owners)
        ingest_and_monitor(each)
    seconds = []
    for _ in range(3):
        number = sum(1 for _ in folder.glob("*.npz"))
        add_recordings(folder, range(number, number + 1), machines)
        seconds.append(timed(lambda: ingest_and_monitor(folder))[1])
    return {"recordings": count, "histories": machines, "seconds": float(np.median(seconds))}


if __name__ == "__main__":
    main()
