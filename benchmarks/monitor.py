"""How a monitor alarms on histories whose change is known: delays, alarms that are none, and time at 10 000 looks.

A gear of 12 teeth with errors is looked at 60 times, and the first 20 looks are labelled healthy. Then nothing changes;
an event at one tooth grows by a step each look; the load rises by a third, stated or not; the sensor is exchanged for
one of twice the gain; or the gear is exchanged. Looks come daily, and 12 false alarms a year are allowed, so that they
can be counted.

    python benchmarks/monitor.py [--histories 20] [--json benchmarks/monitor.json]
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from measuring import environment, print_table, timed

from sigdb.core import FloatArray
from sigdb.diagnosis import Power
from sigdb.monitoring import GearHistory, Look, MonitorSettings, gear_history
from sigdb.monitoring.alarms import alarm_limit
from sigdb.monitoring.look_results import KeptResults
from sigdb.recording import EnvelopeSpectrum, MeshPresence, RecordedSignature

TEETH, SAMPLES, GROUPS = 12, 32, 8
HEALTHY, CHANGED, LOOKS = 20, 30, 60
"""Looks that are labelled healthy, the first look of a change, and all looks."""
FALSE_ALARMS, A_YEAR, GROWTH = 12.0, 365.25, 0.02
PASSES = np.arange(TEETH * SAMPLES) / SAMPLES
MANY = 10_000


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
    "sensor exchanged": lambda step: State(gain=1.0 + (step > 0)),
    "gear exchanged": lambda step: State(gear=int(step > 0)),
}


def main() -> None:
    """Print the tables, or write a JSON document with the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--histories", type=int, default=20, help="histories of each kind; 20 by default")
    parser.add_argument("--json", type=Path, help="file for the numbers")
    options = parser.parse_args()
    rows = [counted(kind, options.histories) for kind in KINDS]
    print_table("Histories", rows)
    seconds = time_of_a_look()
    print_table("One more look", [seconds])
    if options.json is not None:
        document = {"machine": environment("numpy", "scipy"), "histories": rows, "one more look": seconds}
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def counted(kind: str, histories: int) -> dict[str, Any]:
    """Alarms before and after the change, delays and answers of histories of a kind."""
    before, after, delays, answers = 0, 0, [], []
    for seed in range(histories):
        found = history(kind, seed)
        alarms = found.looks["alarm"].to_numpy()
        before += int(alarms[HEALTHY:CHANGED].sum())
        late = alarms[CHANGED:]
        after += int(late.sum())
        delays.append(int(late.argmax()) if late.any() else None)
        answers.append(found.answer.kind)
    seen = [delay for delay in delays if delay is not None]
    common = pd.Series(answers).value_counts()
    return {
        "change": kind,
        "histories": histories,
        "alarms before": before,
        "looks before": histories * (CHANGED - HEALTHY),
        "expected": histories * (CHANGED - HEALTHY) * FALSE_ALARMS / A_YEAR,
        "alarms after": after,
        "looks after": histories * (LOOKS - CHANGED),
        "histories with an alarm": len(seen),
        "median delay": float(np.median(seen)) if seen else None,
        "answers at the end": ", ".join(f"{name}: {count}" for name, count in common.items()),
    }


def history(kind: str, seed: int) -> GearHistory:
    """Return the history of a kind."""
    looks = []
    for number in range(LOOKS):
        state = KINDS[kind](max(0, number - CHANGED + 1))
        one = look(number, seed, state)
        looks.append(replace(one, torque=state.load) if kind == "load, stated" else one)
    limit = alarm_limit(false_alarms_a_year=FALSE_ALARMS, looks_a_year=A_YEAR, healthy=HEALTHY)
    settings = MonitorSettings(false_alarms_a_year=FALSE_ALARMS, looks_a_year=A_YEAR)
    return gear_history(looks, settings, kept=KeptResults(power=NO_POWER, power_limit=limit))


NO_POWER = Power(
    quantity="pulse", smallest=1.0, share_of_rms=1.0, exceptions=pd.DataFrame({"tooth": [], "smallest": []}),
    greatest=1.0, table=pd.DataFrame({"value": [], "seen": []}),
)  # fmt: skip
"""A power that stands for the one that is computed once for a reference."""


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
    mesh = load * sum(np.cos(2 * np.pi * h * PASSES + h) / h for h in (1, 2, 3))
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


def time_of_a_look() -> dict[str, Any]:
    """Processor time of one more look after 10 000, whose results are kept; rows are not read from a database."""
    limit = alarm_limit(false_alarms_a_year=FALSE_ALARMS, looks_a_year=A_YEAR, healthy=HEALTHY)
    settings = MonitorSettings(false_alarms_a_year=FALSE_ALARMS, looks_a_year=A_YEAR)
    kept = KeptResults(power=NO_POWER, power_limit=limit)
    first = [look(number, 0, State()) for number in range(HEALTHY + 1)]
    gear_history(first, settings, kept=kept)
    many = [*first, *(look(number, 0, State()) for number in range(HEALTHY + 1, MANY + 1))]
    result = kept.looks[first[-1].key]
    kept.looks |= {each.key: result for each in many[HEALTHY + 1 : -1]}
    _, seconds = timed(lambda: gear_history(many, settings, kept=kept))
    return {"looks": len(many), "seconds": seconds}


if __name__ == "__main__":
    main()
